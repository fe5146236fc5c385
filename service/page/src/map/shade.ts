// Draws ground and colours into the pixels of the screen: the cost is that of the window, however many posts there are.
import { type Ground, postAt } from "../geo/grid";
import { NONE, type Painting, UNKNOWN } from "./painters";

export interface Window {
  readonly west: number;
  readonly north: number;
  /** Metres per pixel. */
  readonly resolution: number;
  readonly width: number;
  readonly height: number;
}

const STRIPE = 10;
const OPAQUE = 0xff000000;
const VOID_DARK = OPAQUE | 0x9a8f86;
const VOID_LIGHT = OPAQUE | 0xd8d2cc;

/** RGBA of a window on the ground, little-endian as ImageData has it; opacity: of the colours over the relief. */
export function shadeWindow(
  pixels: Uint32Array,
  view: Window,
  ground: Ground,
  painted: Painting | null,
  opacity: number,
  contourM: number,
): void {
  const { dem, extent, shade, heights } = ground;
  const colOf = new Int32Array(view.width);
  for (let x = 0; x < view.width; x += 1) {
    colOf[x] = Math.floor((view.west + (x + 0.5) * view.resolution - extent.west) / dem.cell_east_m);
  }
  const colours = painted?.entries.map((entry) => entry.colour) ?? [];
  const above = new Int32Array(view.width);
  for (let y = 0, at = 0; y < view.height; y += 1) {
    const row = Math.floor((extent.north - (view.north - (y + 0.5) * view.resolution)) / dem.cell_north_m);
    if (row < 0 || row >= dem.rows) {
      at += view.width;
      continue;
    }
    let left = 0;
    for (let x = 0; x < view.width; x += 1, at += 1) {
      const col = colOf[x] as number;
      if (col < 0 || col >= dem.cols) continue;
      const post = postAt(ground, row, col);
      const light = shade[post] as number;
      const striped = (x + y) % STRIPE < 3;
      if (light === 0) {
        pixels[at] = striped ? VOID_DARK : VOID_LIGHT;
        continue;
      }
      const kind = painted === null ? NONE : painted.classAt(row, col);
      const line = contourM > 0 ? Math.floor((heights.heightsM[post] as number) / contourM) : 0;
      const onLine = contourM > 0 && ((x > 0 && line !== left) || (y > 0 && line !== above[x]));
      left = line;
      above[x] = line;
      if (onLine) pixels[at] = OPAQUE | 0x2a4a6a;
      else if (kind === NONE || (kind === UNKNOWN && !striped)) pixels[at] = OPAQUE | (light << 16) | (light << 8) | light;
      else pixels[at] = mixed(kind === UNKNOWN ? 0x55606a : (colours[kind] as number), light, opacity);
    }
  }
}

function mixed(colour: number, light: number, opacity: number): number {
  const grey = light * (1 - opacity);
  const lit = (opacity * (105 + (150 * light) / 255)) / 255;
  const red = grey + ((colour >> 16) & 255) * lit;
  const green = grey + ((colour >> 8) & 255) * lit;
  const blue = grey + (colour & 255) * lit;
  return OPAQUE | (blue << 16) | (green << 8) | red;
}

/** Share of the known posts in each class of a painting, and of those where it is unknown. */
export function sharesOf(ground: Ground, painted: Painting): { shares: number[]; unknown: number } {
  const counts = new Float64Array(painted.entries.length);
  const { rows, cols } = ground.dem;
  // a tenth of a per cent is what is shown, so a large ground is counted on some of its posts
  const step = Math.max(1, Math.floor(Math.sqrt((rows * cols) / 400_000)));
  let [known, unknown] = [0, 0];
  for (let row = 0; row < rows; row += step) {
    for (let col = 0; col < cols; col += step) {
      if (ground.shade[postAt(ground, row, col)] === 0) continue;
      known += 1;
      const kind = painted.classAt(row, col);
      if (kind === UNKNOWN) unknown += 1;
      else if (kind !== NONE) counts[kind] = (counts[kind] as number) + 1;
    }
  }
  return { shares: Array.from(counts, (count) => count / Math.max(known, 1)), unknown: unknown / Math.max(known, 1) };
}
