import { expect, test } from "vitest";
import type { Imported, ImportedPoint } from "../api/imports";
import { anchorsFrom, areaFrom, routeFrom, useOf } from "./imported";
import { NEW_MISSION, newAnchor } from "./mission";

const place = (east_m: number): { east_m: number; north_m: number } => ({ east_m, north_m: 7 });
const none = { max_range_m: null, azimuth_from_deg: null, azimuth_to_deg: null, ranging_sigma_m: null, kind: null, what: null, radio: null };
const point = (id: string, fields: Partial<ImportedPoint>): ImportedPoint => ({ ...place(1), id, above_ground_m: null, altitude_m: null, ...none, ...fields });
const found = (...points: ImportedPoint[]): Imported => ({ format: "KML", points, lines: [], areas: [], told: [] });

test("points become anchors with their heights, and taken ids the next free one", () => {
  const there = [newAnchor([], place(0))];
  const all = anchorsFrom(found(point("D1", { altitude_m: 900 }), point("Mast", { above_ground_m: 0, kind: "mast" }), point("x", {})), there);
  expect(all.map(({ id, kind, height_m, height_from }) => [id, kind, height_m, height_from])).toEqual([
    ["D1", "drone", 120, "above_ground_m"],
    ["D2", "drone", 900, "altitude_m"],
    ["Mast", "mast", 0, "above_ground_m"],
    ["x", "mast", 0, "above_ground_m"],
  ]);
});

test("a line is the way from its first corner to its last, and an area what it is said to be", () => {
  const line = { id: "way", what: "route", places: [place(1), place(2), place(3)] };
  const { route } = routeFrom(line, NEW_MISSION);
  expect([route.start, route.way_points, route.goal]).toEqual([place(1), [place(2)], place(3)]);
  expect(useOf({ ...line, what: "keep-in" })).toBe("keep_in");
  expect(useOf(line)).toBeNull();
  expect(areaFrom(line, "no_go", NEW_MISSION).route?.no_go).toEqual([line.places]);
  expect(areaFrom(line, "area", NEW_MISSION)).toEqual({ area: line.places });
});
