// The posts of a DEM: where they are, how high the ground is between them, how steep.
import type { Heights } from "../api/dems";
import type { Dem, Place } from "../api/types";

export interface Extent {
  readonly west: number;
  readonly south: number;
  readonly east: number;
  readonly north: number;
}

export interface Ground {
  readonly dem: Dem;
  readonly heights: Heights;
  /** Corners of the outermost cells, half a cell beyond their posts, metres. */
  readonly extent: Extent;
  /** Light on each post of heights, 1..255; 0 where the height is unknown. */
  readonly shade: Uint8Array;
  /** Slope at each post of heights, degrees; NaN unknown. */
  readonly slopeDeg: Float32Array;
}

const LIGHT_FROM_RAD = (315 * Math.PI) / 180;
const LIGHT_UP_RAD = (45 * Math.PI) / 180;

export function extentOf(dem: Dem): Extent {
  const { west, south, east, north } = dem.bounds_of_posts_m;
  const [halfEast, halfNorth] = [dem.cell_east_m / 2, dem.cell_north_m / 2];
  return { west: west - halfEast, south: south - halfNorth, east: east + halfEast, north: north + halfNorth };
}

export function makeGround(dem: Dem, heights: Heights): Ground {
  const { rows, cols, heightsM } = heights;
  const step = 2 ** heights.level;
  const [acrossM, downM] = [dem.cell_east_m * step, dem.cell_north_m * step];
  const shade = new Uint8Array(rows * cols);
  const slopeDeg = new Float32Array(rows * cols);
  const [up, level] = [Math.sin(LIGHT_UP_RAD), Math.cos(LIGHT_UP_RAD)];
  const [lightEast, lightNorth] = [Math.sin(LIGHT_FROM_RAD) * level, Math.cos(LIGHT_FROM_RAD) * level];
  for (let row = 0, at = 0; row < rows; row += 1) {
    for (let col = 0; col < cols; col += 1, at += 1) {
      const here = heightsM[at] as number;
      if (Number.isNaN(here)) {
        slopeDeg[at] = NaN;
        continue;
      }
      const east = rise(heightsM, at, col > 0 ? -1 : 0, col < cols - 1 ? 1 : 0, acrossM);
      const south = rise(heightsM, at, row > 0 ? -cols : 0, row < rows - 1 ? cols : 0, downM);
      const steep = Math.hypot(east, south);
      const lit = (up - east * lightEast + south * lightNorth) / Math.sqrt(1 + steep * steep);
      shade[at] = Math.max(1, Math.min(255, Math.round(70 + 185 * Math.max(0, lit))));
      slopeDeg[at] = (Math.atan(steep) * 180) / Math.PI;
    }
  }
  return { dem, heights, extent: extentOf(dem), shade, slopeDeg };
}

/** Rise per metre between two neighbours; where one is unknown the post itself takes its place. */
function rise(heightsM: Float32Array, at: number, before: number, after: number, cellM: number): number {
  let [from, to] = [before, after];
  if (Number.isNaN(heightsM[at + from])) from = 0;
  if (Number.isNaN(heightsM[at + to])) to = 0;
  if (from === to) return 0;
  const cells = (from === 0 ? 0 : 1) + (to === 0 ? 0 : 1);
  return ((heightsM[at + to] as number) - (heightsM[at + from] as number)) / (cells * cellM);
}

export function contains(extent: Extent, place: Place): boolean {
  const { east_m: east, north_m: north } = place;
  return east >= extent.west && east <= extent.east && north >= extent.south && north <= extent.north;
}

/** Row and column of the post whose cell holds a place, of the whole DEM; null outside. */
export function cellAt(ground: Ground, place: Place): { row: number; col: number } | null {
  const { dem, extent } = ground;
  if (!contains(extent, place)) return null;
  const row = Math.min(dem.rows - 1, Math.floor((extent.north - place.north_m) / dem.cell_north_m));
  const col = Math.min(dem.cols - 1, Math.floor((place.east_m - extent.west) / dem.cell_east_m));
  return { row, col };
}

/** Number of the nearest kept post of a cell of the whole DEM. */
export function postAt(ground: Ground, row: number, col: number): number {
  const { level, cols } = ground.heights;
  return (row >> level) * cols + (col >> level);
}

/** Height of the surface between posts, metres; NaN unknown or outside. */
export function heightAt(ground: Ground, place: Place): number {
  const { dem, heights } = ground;
  const step = 2 ** heights.level;
  const middle = (step - 1) / 2;
  const x = ((place.east_m - dem.bounds_of_posts_m.west) / dem.cell_east_m - middle) / step;
  const y = ((dem.bounds_of_posts_m.north - place.north_m) / dem.cell_north_m - middle) / step;
  if (x < -0.5 || y < -0.5 || x > heights.cols - 0.5 || y > heights.rows - 0.5) return NaN;
  const [col, row] = [clamp(Math.floor(x), heights.cols - 2), clamp(Math.floor(y), heights.rows - 2)];
  const [u, v] = [Math.min(1, Math.max(0, x - col)), Math.min(1, Math.max(0, y - row))];
  const at = row * heights.cols + col;
  const [nw, ne] = [heights.heightsM[at] as number, heights.heightsM[at + 1] as number];
  const [sw, se] = [heights.heightsM[at + heights.cols] as number, heights.heightsM[at + heights.cols + 1] as number];
  return (nw * (1 - u) + ne * u) * (1 - v) + (sw * (1 - u) + se * u) * v;
}

function clamp(value: number, most: number): number {
  return Math.max(0, Math.min(most, value));
}

export function slopeAt(ground: Ground, place: Place): number {
  const cell = cellAt(ground, place);
  return cell ? (ground.slopeDeg[postAt(ground, cell.row, cell.col)] ?? NaN) : NaN;
}

/** The highest known post within a distance of a place; null where all is unknown. */
export function highestNear(ground: Ground, place: Place, withinM: number): Place | null {
  const { dem, heights } = ground;
  const step = 2 ** heights.level;
  const [acrossM, downM] = [dem.cell_east_m * step, dem.cell_north_m * step];
  const west0 = dem.bounds_of_posts_m.west + ((step - 1) / 2) * dem.cell_east_m;
  const north0 = dem.bounds_of_posts_m.north - ((step - 1) / 2) * dem.cell_north_m;
  const [col0, row0] = [(place.east_m - west0) / acrossM, (north0 - place.north_m) / downM];
  let best: { height: number; row: number; col: number } | null = null;
  const [first, last] = [Math.ceil(row0 - withinM / downM), Math.floor(row0 + withinM / downM)];
  for (let row = Math.max(0, first); row <= Math.min(heights.rows - 1, last); row += 1) {
    const reach = Math.sqrt(Math.max(0, withinM ** 2 - ((row - row0) * downM) ** 2)) / acrossM;
    const [west, east] = [Math.max(0, Math.ceil(col0 - reach)), Math.min(heights.cols - 1, Math.floor(col0 + reach))];
    for (let col = west; col <= east; col += 1) {
      const height = heights.heightsM[row * heights.cols + col] as number;
      if (!Number.isNaN(height) && (best === null || height > best.height)) best = { height, row, col };
    }
  }
  if (best === null) return null;
  return { east_m: west0 + best.col * acrossM, north_m: north0 - best.row * downM };
}
