// Where along a path too few anchors are in sight.
import type { Positioning } from "../mission/mission";
import type { Vertex } from "./path";

export interface Dark {
  readonly from: Vertex;
  readonly to: Vertex;
  readonly fewest: number;
}

/** How many anchors a fix needs: one for each unknown of place, one more where a clock is unknown too. */
export function fixNeeds({ kind, on_surface }: Positioning): number {
  return (kind === "ranging" ? 3 : 4) - (on_surface ? 1 : 0);
}

/** The stretches of a path with fewer anchors in sight; a piece between two places is dark when one of its ends is. */
export function darkStretches(vertices: readonly Vertex[], least: number): readonly Dark[] {
  const found: Dark[] = [];
  let before = false;
  for (let at = 1; at < vertices.length; at += 1) {
    const [from, to] = [vertices[at - 1] as Vertex, vertices[at] as Vertex];
    const fewest = Math.min(from.anchor_count, to.anchor_count);
    const last = before && fewest < least ? found.pop() : undefined;
    before = fewest < least;
    if (before) found.push({ from: last?.from ?? from, to, fewest: Math.min(last?.fewest ?? Infinity, fewest) });
  }
  return found;
}
