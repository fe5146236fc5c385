import { expect, test } from "vitest";
import { alongOf } from "./profile";

const places = [0, 100, 200, 300, 400].map((east_m) => ({ east_m, north_m: 0 }));
const profile = { places, distanceM: [0, 110, 220, 330, 440] };

test("a pointer over the map is where the profile passes nearest, if that is near", () => {
  expect(alongOf(profile, { east_m: 204, north_m: -15 })).toBe(220);
  expect(alongOf(profile, { east_m: 204, north_m: 23 })).toBeNull();
  expect(alongOf({ places: [], distanceM: [] }, { east_m: 0, north_m: 0 })).toBeNull();
});
