// The posts under the pixels of a window, or every so-manieth of a ground: what is picked for them stays picked until the
// window changes, so that a slider runs over arrays in the order of the pixels.
import type { Ground } from "./grid";

export interface Window {
  readonly west: number;
  readonly north: number;
  /** Metres per pixel. */
  readonly resolution: number;
  readonly width: number;
  readonly height: number;
}

type Values = Float32Array | Int32Array | Uint8Array;

export class Sample {
  private readonly picked = new WeakMap<Values, Values>();

  /** posts: the kept post of each place, in the order of the pixels. */
  constructor(readonly posts: Int32Array) {}

  /** Values of the kept posts, for each place. */
  of<T extends Values>(values: T): T {
    const known = this.picked.get(values);
    if (known) return known as T;
    const { posts } = this;
    const here = new (values.constructor as new (length: number) => T)(posts.length);
    for (let at = 0; at < posts.length; at += 1) here[at] = values[posts[at] as number] as number;
    this.picked.set(values, here);
    return here;
  }
}

/** The pixels of a window that lie on the ground, which are a rectangle, row by row from the north-west. */
export interface Covered {
  readonly left: number;
  readonly top: number;
  readonly width: number;
  readonly height: number;
  readonly sample: Sample;
}

/** null: the window lies beside the ground. */
export function coveredBy(view: Window, ground: Ground): Covered | null {
  const { dem, extent, heights } = ground;
  const cols = onGround(view.width, (view.west - extent.west) / dem.cell_east_m, view.resolution / dem.cell_east_m, dem.cols);
  const rows = onGround(view.height, (extent.north - view.north) / dem.cell_north_m, view.resolution / dem.cell_north_m, dem.rows);
  const [width, height] = [cols.cells.length, rows.cells.length];
  if (width === 0 || height === 0) return null;
  const posts = new Int32Array(width * height);
  for (let y = 0, at = 0; y < height; y += 1) {
    const first = ((rows.cells[y] as number) >> heights.level) * heights.cols;
    for (let x = 0; x < width; x += 1, at += 1) posts[at] = first + ((cols.cells[x] as number) >> heights.level);
  }
  return { left: cols.first, top: rows.first, width, height, sample: new Sample(posts) };
}

/** Which of so many pixels in a line lie on the ground, and in which cell each; the line begins at a number of cells. */
function onGround(pixels: number, begin: number, cellsPerPixel: number, count: number): { first: number; cells: Int32Array } {
  const first = Math.max(0, Math.ceil(-begin / cellsPerPixel - 0.5));
  const cells: number[] = [];
  for (let pixel = first; pixel < pixels; pixel += 1) {
    const cell = Math.floor(begin + (pixel + 0.5) * cellsPerPixel);
    if (cell >= count) break;
    cells.push(Math.max(0, cell));
  }
  return { first, cells: Int32Array.from(cells) };
}

const MOST_COUNTED = 400_000;
const counted = new WeakMap<Ground, Sample>();

/** All kept posts of a ground, or of a large one as many as a share to a tenth of a per cent takes. */
export function countedPosts(ground: Ground): Sample {
  const known = counted.get(ground);
  if (known) return known;
  const { rows, cols } = ground.heights;
  const step = Math.max(1, Math.floor(Math.sqrt((rows * cols) / MOST_COUNTED)));
  const [down, across] = [Math.ceil(rows / step), Math.ceil(cols / step)];
  const posts = new Int32Array(down * across);
  for (let at = 0; at < posts.length; at += 1) posts[at] = Math.floor(at / across) * step * cols + (at % across) * step;
  const sample = new Sample(posts);
  counted.set(ground, sample);
  return sample;
}
