import { expect, test } from "vitest";
import { between } from "./ahead";

const place = (east_m: number, north_m: number) => ({ east_m, north_m });
const corner = [place(0, 0), place(100, 0), place(100, 50)];

test("a stretch of a way is cut at its distances, corners included", () => {
  expect(between(corner, 40, 120)).toEqual([place(40, 0), place(100, 0), place(100, 20)]);
  expect(between(corner, 110, 500)).toEqual([place(100, 10), place(100, 50)]);
  expect(between(corner, 200, 300)).toEqual([]);
});
