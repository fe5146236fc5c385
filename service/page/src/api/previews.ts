// Maps by a look: numbers over the kept posts, calculated while one waits, of which the service keeps nothing.
import { askBytes, posted } from "./http";
import type { Dem, Summary } from "./types";

export interface Preview extends Summary {
  readonly names: readonly string[];
  readonly rows: number;
  readonly cols: number;
  readonly arrays: readonly Float32Array[];
}

const LINE_END = 10;
const WAIT_S = 60;
/** So many posts are calculated anew at once while something is dragged; of signals, when it rests and while it is. */
const DRAGGED_POSTS = 1_000_000;
const HEARD_POSTS = 150_000;
const DRAGGED_HEARD_POSTS = 20_000;

export async function preview(body: unknown): Promise<Preview> {
  const answer = await askBytes("/previews", posted(body, WAIT_S));
  const bytes = new Uint8Array(answer);
  const end = bytes.indexOf(LINE_END);
  const told = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end))) as Omit<Preview, "arrays">;
  const posts = told.rows * told.cols;
  const arrays = told.names.map((_, number) => new Float32Array(answer, end + 1 + 4 * posts * number, posts));
  return { ...told, arrays };
}

/** The level that maps are asked at, the finest from least on that is quick enough, and the one that a drag is followed at. */
export function levelsFor(dem: Dem, least: number, heard: boolean): { readonly full: number; readonly dragged: number } {
  const within = (from: number, posts: number): number => {
    let level = from;
    while ((dem.rows >> level) * (dem.cols >> level) > posts) level += 1;
    return level;
  };
  const full = heard ? within(least, HEARD_POSTS) : least;
  return { full, dragged: within(full, heard ? DRAGGED_HEARD_POSTS : DRAGGED_POSTS) };
}

/** An array of a preview, each value as often as posts of the ground lie under it. */
export function keptOf(found: Preview, number: number, levels: number, rows: number, cols: number): Float32Array {
  const values = found.arrays[number] as Float32Array;
  return levels === 0 ? values : spread(values, found.cols, levels, rows, cols);
}

function spread(coarse: Float32Array, coarseCols: number, levels: number, rows: number, cols: number): Float32Array {
  const all = new Float32Array(rows * cols);
  for (let row = 0, at = 0; row < rows; row += 1) {
    const first = (row >> levels) * coarseCols;
    for (let col = 0; col < cols; col += 1, at += 1) all[at] = coarse[first + (col >> levels)] as number;
  }
  return all;
}
