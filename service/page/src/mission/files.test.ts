import { expect, test } from "vitest";
import { missionOf, missionText } from "./files";
import { NEW_MISSION, newAnchor } from "./mission";

test("a mission is the same after it went through its file", () => {
  const mission = { ...NEW_MISSION, name: "Valley", anchors: [newAnchor([], { east_m: 1, north_m: 2 })] };
  expect(missionOf(missionText(mission))).toEqual(mission);
});

test("other JSON, other words and places that are no numbers are no missions", () => {
  for (const text of ["", "{}", '{"format": "sightline-mission", "version": 2}']) expect(() => missionOf(text)).toThrow(/no mission file/);
  const bad = missionText({ ...NEW_MISSION, anchors: [newAnchor([], { east_m: NaN, north_m: 2 })] });
  expect(() => missionOf(bad)).toThrow(/no mission file/);
});
