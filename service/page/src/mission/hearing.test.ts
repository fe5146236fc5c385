import { expect, test } from "vitest";
import { bestOf } from "../products/margins";
import { isHeard, sightBody, sightKey, silent } from "./hearing";
import { anchorBody, heardBody, NEW_MISSION, newAnchor, type Trees } from "./mission";

const trees: Trees = { what: "top", top_m: 18, name: null, base64: null, base_m: 3, depth_per_m: null };
const mute = newAnchor([], { east_m: 1, north_m: 2 });
const loud = { ...mute, id: "D2", radio: "868MHz" } as const;
const usable = { ...NEW_MISSION, trees, anchors: [loud], positioning: { ...NEW_MISSION.positioning, sight: "usable" } } as const;

test("maps are of usable signals where that is asked for and every anchor has a radio", () => {
  expect(isHeard(usable)).toBe(true);
  expect(isHeard({ ...usable, anchors: [loud, mute] })).toBe(false);
  expect(silent({ anchors: [loud, mute] })).toEqual(["D1"]);
  expect(isHeard({ ...usable, positioning: NEW_MISSION.positioning })).toBe(false);
  expect(isHeard({ ...usable, anchors: [] })).toBe(false);
});

test("questions of usable signals have radios and trees, those of sight neither", () => {
  expect(sightBody(usable)).toEqual({ anchors: [heardBody(loud)], sight: "usable", cover: { canopy: { top_m: 18, base_m: 3 } } });
  expect(sightBody({ ...usable, anchors: [loud, mute] })).toEqual({ anchors: [anchorBody(loud), anchorBody(mute)] });
});

test("what was calculated for other trees or radios is not taken for the mission as it is", () => {
  const key = JSON.stringify(sightKey(usable));
  expect(JSON.stringify(sightKey({ ...usable, trees: { ...trees, top_m: 4 } }))).not.toBe(key);
  expect(JSON.stringify(sightKey({ ...usable, anchors: [{ ...loud, radio: "uwb" }] }))).not.toBe(key);
  expect(JSON.stringify(sightKey({ ...usable, anchors: [{ ...loud }] }))).toBe(key);
});

test("the best signal is the highest of each place, and unknown where one that is not known could make it usable", () => {
  const found = bestOf([new Float32Array([5, -3, NaN, NaN]), new Float32Array([-1, -Infinity, -2, 7])]);
  expect([...found]).toEqual([5, -3, NaN, 7]);
});
