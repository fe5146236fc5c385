import { expect, test } from "vitest";
import { anchorsCsv, anchorsGeoJson, anchorsOf, placeOf } from "./anchorTexts";
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

test("anchors survive a round trip through CSV and GeoJSON", () => {
  const first = { ...newAnchor([], { east_m: 740000, north_m: 4030000 }), max_range_m: 9000 };
  const second = { ...newAnchor([first], { east_m: 741000, north_m: 4031000 }), height_from: "altitude_m" as const, height_m: 900 };
  expect(anchorsOf(anchorsCsv([first, second]), [], around)).toEqual([first, second]);
  const again = anchorsOf(anchorsGeoJson([first, second], around.frame), [], around);
  expect(again.map(({ id, height_m, height_from }) => [id, height_m, height_from])).toEqual([
    ["D1", 120, "above_ground_m"],
    ["D2", 900, "altitude_m"],
  ]);
  expect(again[0]?.east_m).toBeCloseTo(740000, 3);
});

test("an id that is taken gets the next free one", () => {
  const there = [newAnchor([], { east_m: 740000, north_m: 4030000 })];
  const [added] = anchorsOf("id,east_m,north_m\nD1,741000,4031000\n", there, around);
  expect(added?.id).toBe("D2");
});
