import { expect, test } from "vitest";
import { anchorsOf, boxOf, placeOf } from "./anchorTexts";
import { frameOf } from "../geo/frames";
import { newAnchor } from "./mission";
import type { Dem } from "../api/types";

const UTM = { crs: "EPSG:32616", body: "Earth" } as Dem;
const around = { extent: { west: 730000, south: 4010000, east: 765000, north: 4045000 }, frame: frameOf(UTM) };
const local = { extent: { west: 0, south: 0, east: 100, north: 100 }, frame: frameOf({ crs: null, body: null } as Dem) };

test("metres within the ground are metres, small numbers are latitude and longitude", () => {
  expect(placeOf("740000 4030000", around)).toEqual({ east_m: 740000, north_m: 4030000 });
  const place = placeOf("36.384486, -84.290912", around);
  expect(place.east_m).toBeCloseTo(743000, -1);
  expect(place.north_m).toBeCloseTo(4030004, -1);
  expect(placeOf("36.384486° N 84.290912° W", around)).toEqual(place);
  expect(placeOf("84.290912 W, 36.384486 N", around)).toEqual(place);
});

test("a place beyond the ground, words, and degrees without a frame are refused in one sentence", () => {
  expect(() => placeOf("10, 20", around)).toThrow(/outside the ground/);
  expect(() => placeOf("over there", around)).toThrow(/holds no place/);
  expect(() => placeOf("-36.4, -84.2", local)).toThrow(/no degrees/);
});

test("a table and GeoJSON are pasted with their heights", () => {
  const [first, second] = anchorsOf("id,east_m,north_m,above_ground_m,altitude_m,max_range_m\nD1,740000,4030000,120,,9000\nD2,741000,4031000,,900,\n", [], around);
  expect([first?.max_range_m, first?.height_m, first?.height_from]).toEqual([9000, 120, "above_ground_m"]);
  expect([second?.height_m, second?.height_from]).toEqual([900, "altitude_m"]);
  const geometry = { type: "Point", coordinates: [-84.290912, 36.384486] };
  const text = JSON.stringify({ type: "FeatureCollection", features: [{ geometry, properties: { id: "D7", altitude_m: 900 } }] });
  const [only] = anchorsOf(text, [], around);
  expect([only?.id, only?.height_m, only?.height_from]).toEqual(["D7", 900, "altitude_m"]);
  expect(only?.east_m).toBeCloseTo(743000, -1);
});

test("an id that is taken gets the next free one", () => {
  const there = [newAnchor([], { east_m: 740000, north_m: 4030000 })];
  const [added] = anchorsOf("id,east_m,north_m\nD1,741000,4031000\n", there, around);
  expect(added?.id).toBe("D2");
});

test("a box is west, south, east, north in degrees, with letters or signs; anything else is refused in one sentence", () => {
  expect(boxOf("-84.3, 36.2, -84.2, 36.3")).toEqual([-84.3, 36.2, -84.2, 36.3]);
  expect(boxOf("84.3° W 36.2° N 84.2° W 36.3° N")).toEqual([-84.3, 36.2, -84.2, 36.3]);
  expect(boxOf("179.9 -1 -179.9 1")).toEqual([179.9, -1, -179.9, 1]);
  for (const text of ["", "1 2 3", "1 2 3 4 5", "1 3 2 2", "1 2 1 3", "0 -91 1 0", "nowhere"]) expect(() => boxOf(text)).toThrow(/is no box/);
});
