import { expect, test } from "vitest";
import { anchorBody, coverBody, heardBody, isLimited, missionOf, NEW_MISSION, newAnchor, nextId } from "./mission";
import { moved } from "./moved";

const first = newAnchor([], { east_m: 10, north_m: 20 });
const anchors = [first];

test("new anchors take the first free id and the height of the one before", () => {
  expect(nextId(anchors)).toBe("D2");
  expect(newAnchor([{ ...first, height_m: 80 }], { east_m: 0, north_m: 0 }).height_m).toBe(80);
  expect(first.height_m).toBe(120);
});

test("the service is asked with the height that was given, and with the limits that there are", () => {
  const body = anchorBody({ ...first, height_from: "altitude_m", height_m: 900, max_range_m: 5000 });
  expect(body).toEqual({ id: "D1", east_m: 10, north_m: 20, altitude_m: 900, ranging_sigma_m: 0.1, max_range_m: 5000 });
  expect(isLimited(first)).toBe(false);
});

test("a radio is asked about where signals are told, is taken on by the next anchor, and no older mission has one", () => {
  const heard = { ...first, radio: "868MHz" } as const;
  expect(heardBody(heard)).toEqual({ ...anchorBody(heard), radio: "868MHz" });
  expect(heardBody(first)).toEqual(anchorBody(first));
  expect(newAnchor([heard], { east_m: 0, north_m: 0 }).radio).toBe("868MHz");
  const { radio: _, ...older } = first;
  expect(missionOf({ anchors: [older as typeof first] }).anchors).toEqual([first]);
});

test("what has no place on another ground is left out and named, the rest moves", () => {
  const route = { ...NEW_MISSION.route, start: { east_m: 1, north_m: 1 }, goal: { east_m: 500, north_m: 1 } };
  const mission = { ...NEW_MISSION, anchors, route };
  const found = moved(mission, ({ east_m, north_m }) => (east_m < 100 ? { east_m: east_m + 1000, north_m } : null));
  expect(found.lost).toEqual(["the goal"]);
  expect(found.mission.anchors[0]?.east_m).toBe(1010);
  expect(found.mission.route.start).toEqual({ east_m: 1001, north_m: 1 });
  expect(found.mission.route.goal).toBeNull();
});

test("buildings in degrees stay on another ground, those in its metres are left out and named", () => {
  const buildings = { name: "town.geojson", geojson: { type: "FeatureCollection", features: [] }, level_m: 3, default_height_m: null };
  const here = (place: { east_m: number; north_m: number }) => place;
  expect(moved({ ...NEW_MISSION, buildings }, here)).toEqual({ mission: { ...NEW_MISSION, buildings }, lost: [] });
  const metres = { ...buildings, geojson: { ...buildings.geojson, coordinates_are: "metres" } };
  expect(moved({ ...NEW_MISSION, buildings: metres }, here)).toEqual({ mission: NEW_MISSION, lost: ["the buildings"] });
  expect(coverBody(null)).toEqual({});
  expect(coverBody(buildings)).toEqual({ cover: { footprints: { geojson: buildings.geojson, level_m: 3, default_height_m: null } } });
});
