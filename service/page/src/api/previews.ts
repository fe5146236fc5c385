// Maps by a look: numbers over the kept posts, calculated while one waits, of which the service keeps nothing.
import { ask, posted } from "./http";
import type { Dem, Summary } from "./types";

export interface Preview extends Summary {
  readonly names: readonly string[];
  readonly rows: number;
  readonly cols: number;
  readonly arrays: readonly Float32Array[];
}

const LINE_END = 10;
const WAIT_S = 60;
/** So many posts are calculated anew at once while something is dragged. */
const DRAGGED_POSTS = 1_000_000;

export async function preview(body: unknown): Promise<Preview> {
  const answer = await (await ask("/previews", posted(body, WAIT_S))).arrayBuffer();
  const bytes = new Uint8Array(answer);
  const end = bytes.indexOf(LINE_END);
  const told = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end))) as Omit<Preview, "arrays">;
  const posts = told.rows * told.cols;
  const arrays = told.names.map((_, number) => new Float32Array(answer, end + 1 + 4 * posts * number, posts));
  return { ...told, arrays };
}

/** The level that a drag is followed at: the finest from least on that is quick enough. */
export function draggedLevel(dem: Dem, least: number): number {
  let level = least;
  while ((dem.rows >> level) * (dem.cols >> level) > DRAGGED_POSTS) level += 1;
  return level;
}

/** Values of a coarser level, each as often as posts of the finer one lie under it. */
export function spread(values: Preview, levels: number, rows: number, cols: number): Float32Array {
  const [coarse] = values.arrays;
  const all = new Float32Array(rows * cols);
  for (let row = 0, at = 0; row < rows; row += 1) {
    const first = (row >> levels) * values.cols;
    for (let col = 0; col < cols; col += 1, at += 1) all[at] = (coarse as Float32Array)[first + (col >> levels)] as number;
  }
  return all;
}
