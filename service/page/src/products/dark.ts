// Where along a path too few anchors are in sight.
import type { Vertex } from "./path";

export interface Dark {
  readonly from: Vertex;
  readonly to: Vertex;
  readonly fewest: number;
}

/** The stretches of a path where fewer anchors are in sight than there must be. */
export function darkStretches(vertices: readonly Vertex[], least: number): readonly Dark[] {
  const found: Dark[] = [];
  let before = false;
  for (const vertex of vertices) {
    const dark = vertex.anchor_count < least;
    const last = before ? found.pop() : undefined;
    if (last && !dark) found.push(last);
    else if (dark) found.push({ from: last?.from ?? vertex, to: vertex, fewest: Math.min(last?.fewest ?? Infinity, vertex.anchor_count) });
    before = dark;
  }
  return found;
}
