import { expect, test } from "vitest";
import type { Dem } from "../api/types";
import { cellAt, heightAt, highestNear, makeGround, slopeAt } from "./grid";

const ROWS = 6;
const COLS = 8;
const CELL_M = 10;

/** A plane that rises 0.5 m a metre to the east and 0.25 m a metre to the south, on posts every 10 m. */
function plane(change?: (heights: Float32Array) => void) {
  const bounds_of_posts_m = { west: 1000, south: 2000, east: 1000 + (COLS - 1) * CELL_M, north: 2000 + (ROWS - 1) * CELL_M };
  const dem = { id: "x", rows: ROWS, cols: COLS, cell_east_m: CELL_M, cell_north_m: CELL_M, bounds_of_posts_m } as Dem;
  const heightsM = Float32Array.from({ length: ROWS * COLS }, (_, at) => 5 * (at % COLS) + 2.5 * Math.floor(at / COLS));
  change?.(heightsM);
  return makeGround(dem, { level: 0, rows: ROWS, cols: COLS, heightsM });
}

test("the surface between posts and its slope are those of the plane", () => {
  const ground = plane();
  expect(heightAt(ground, { east_m: 1017, north_m: 2050 - 13 })).toBeCloseTo(0.5 * 17 + 0.25 * 13, 4);
  expect(slopeAt(ground, { east_m: 1030, north_m: 2030 })).toBeCloseTo((Math.atan(Math.hypot(0.5, 0.25)) * 180) / Math.PI, 4);
});

test("the cell of a place counts from the north-west, half a cell round each post", () => {
  const ground = plane();
  expect(cellAt(ground, { east_m: 995.1, north_m: 2054.9 })).toEqual({ row: 0, col: 0 });
  expect(cellAt(ground, { east_m: 1074.9, north_m: 1995.1 })).toEqual({ row: ROWS - 1, col: COLS - 1 });
  expect(cellAt(ground, { east_m: 994.9, north_m: 2050 })).toBeNull();
});

test("unknown ground has no height, no slope and no light", () => {
  const ground = plane((heights) => (heights[0] = NaN));
  expect(heightAt(ground, { east_m: 1004, north_m: 2046 })).toBeNaN();
  expect(slopeAt(ground, { east_m: 1000, north_m: 2050 })).toBeNaN();
  expect(ground.shade[0]).toBe(0);
  expect(Math.min(...ground.shade.slice(1))).toBeGreaterThan(0);
});

test("the highest place near is within the distance", () => {
  const ground = plane();
  expect(highestNear(ground, { east_m: 1000, north_m: 2050 }, 20)).toEqual({ east_m: 1020, north_m: 2050 });
});
