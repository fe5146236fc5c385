import { expect, test } from "vitest";
import { alongAt } from "./flight";

// 3-4-5 and 0-0-12: five metres through the air, then twelve straight up
const corners = [
  { east_m: 0, north_m: 0, altitude_m: 10 },
  { east_m: 3, north_m: 0, altitude_m: 14 },
  { east_m: 3, north_m: 0, altitude_m: 26 },
  { east_m: 3, north_m: 8, altitude_m: 26 },
];

test("a place along a flight is found through the air, not over the map", () => {
  expect(alongAt(corners, 0)).toEqual({ east_m: 0, north_m: 0 });
  expect(alongAt(corners, 2.5)).toEqual({ east_m: 1.5, north_m: 0 });
  expect(alongAt(corners, 11)).toEqual({ east_m: 3, north_m: 0 });
  expect(alongAt(corners, 21)).toEqual({ east_m: 3, north_m: 4 });
  expect(alongAt(corners, 99)).toEqual({ east_m: 3, north_m: 8 });
});
