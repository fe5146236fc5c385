import { expect, test } from "vitest";
import type { Dem } from "../api/types";
import { makeGround } from "../geo/grid";
import { UNKNOWN } from "./painters";
import { shadeWindow, sharesOf } from "./shade";

const bounds_of_posts_m = { west: 0, south: 0, east: 30, north: 10 };
const dem = { id: "x", rows: 2, cols: 4, cell_east_m: 10, cell_north_m: 10, bounds_of_posts_m } as Dem;
const ground = makeGround(dem, { level: 0, rows: 2, cols: 4, heightsM: Float32Array.from([1, 1, 1, NaN, 1, 1, 1, 1]) });
const painted = {
  title: "",
  entries: [
    { colour: 0xff0000, label: "a" },
    { colour: 0x0000ff, label: "b" },
  ],
  classAt: (row: number, col: number) => (row === 1 && col === 0 ? UNKNOWN : col < 2 ? 0 : 1),
};

test("each pixel has the colour of the post whose cell it lies in, and beyond the ground it is clear", () => {
  const [width, height] = [6, 4];
  const pixels = new Uint32Array(width * height);
  shadeWindow(pixels, { west: -15, north: 25, resolution: 10, width, height }, ground, painted, 1, 0);
  const channel = (at: number, byte: number): number => ((pixels[at] as number) >>> (8 * byte)) & 255;
  expect(pixels[0]).toBe(0);
  const first = width + 1;
  expect([channel(first, 0) > 100, channel(first, 2)]).toEqual([true, 0]);
  expect([channel(first + 2, 0), channel(first + 2, 2) > 100]).toEqual([0, true]);
});

test("shares are of the posts whose height is known", () => {
  const { shares, unknown } = sharesOf(ground, painted);
  expect(shares).toEqual([3 / 7, 3 / 7]);
  expect(unknown).toBeCloseTo(1 / 7);
});
