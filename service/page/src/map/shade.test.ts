import { expect, test } from "vitest";
import type { Dem } from "../api/types";
import { makeGround } from "../geo/grid";
import { type Covered, coveredBy, type Sample } from "../geo/sample";
import { UNKNOWN } from "./painters";
import { shade, sharesOf } from "./shade";

const bounds_of_posts_m = { west: 0, south: 0, east: 30, north: 10 };
const dem = { id: "x", rows: 2, cols: 4, cell_east_m: 10, cell_north_m: 10, bounds_of_posts_m } as Dem;
const ground = makeGround(dem, { level: 0, rows: 2, cols: 4, heightsM: Float32Array.from([1, 1, 1, NaN, 1, 1, 1, 1]) });
const painted = {
  title: "",
  entries: [
    { colour: 0xff0000, label: "a" },
    { colour: 0x0000ff, label: "b" },
  ],
  classify: ({ posts }: Sample, kinds: Int16Array) => posts.forEach((post, at) => (kinds[at] = post === 4 ? UNKNOWN : post % 4 < 2 ? 0 : 1)),
};

test("each pixel has the colour of the post whose cell it lies in, and there are none beyond the ground", () => {
  const here = coveredBy({ west: -15, north: 25, resolution: 10, width: 6, height: 4 }, ground) as Covered;
  expect([here.left, here.top, here.width, here.height]).toEqual([1, 1, 4, 2]);
  expect(Array.from(here.sample.posts)).toEqual([0, 1, 2, 3, 4, 5, 6, 7]);
  const pixels = new Uint32Array(8);
  shade(pixels, here, ground, painted, 1, 0);
  const channel = (at: number, byte: number): number => ((pixels[at] as number) >>> (8 * byte)) & 255;
  expect([channel(0, 0) > 100, channel(0, 2)]).toEqual([true, 0]);
  expect([channel(2, 0), channel(2, 2) > 100]).toEqual([0, true]);
});

test("a window that shows a part of the ground, finer than its posts, or none of it", () => {
  const part = coveredBy({ west: 12, north: 8, resolution: 4, width: 4, height: 2 }, ground) as Covered;
  // pixel centres at 14, 18, 22, 26 east and 6, 2 north; cells end at 15 and 25 east and 5 north
  expect(Array.from(part.sample.posts)).toEqual([1, 2, 2, 3, 5, 6, 6, 7]);
  expect(coveredBy({ west: 40, north: 8, resolution: 4, width: 4, height: 2 }, ground)).toBeNull();
});

test("shares are of the posts whose height is known", () => {
  const { shares, unknown } = sharesOf(ground, painted);
  expect(shares).toEqual([3 / 7, 3 / 7]);
  expect(unknown).toBeCloseTo(1 / 7);
});

test("a contour line runs between the heights that it parts, and not round unknown ground", () => {
  const stairs = makeGround(dem, { level: 0, rows: 2, cols: 4, heightsM: Float32Array.from([1, 1, 12, NaN, 1, 1, 12, 12]) });
  const here = coveredBy({ west: -5, north: 15, resolution: 10, width: 4, height: 2 }, stairs) as Covered;
  const [plain, drawn] = [new Uint32Array(8), new Uint32Array(8)];
  shade(plain, here, stairs, null, 1, 0);
  shade(drawn, here, stairs, null, 1, 10);
  expect(Array.from(drawn, (pixel, at) => pixel !== plain[at])).toEqual([false, false, true, false, false, false, true, false]);
});
