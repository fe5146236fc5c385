import { expect, test } from "vitest";
import type { Ground } from "../geo/grid";
import { type Mission, NEW_MISSION } from "../mission/mission";
import { enoughOf, placementBody, spacingOf } from "./placement";

const here = { dem: { id: "g" }, extent: { west: 0, south: 0, east: 2800, north: 1400 } } as Ground;
const { positioning, placing } = NEW_MISSION;
const D1 = { id: "D1", east_m: 700, north_m: 700, kind: "drone", height_m: 120, height_from: "above_ground_m", max_range_m: null } as const;
const SENDS = { ...D1, azimuth_from_deg: null, azimuth_to_deg: null, ranging_sigma_m: 0.1, radio: "868MHz", flies_to: [], flies_m_per_s: 5 } as const;

function bodyOf(fields: Partial<typeof placing>, more: Partial<Mission> = {}): Record<string, unknown> {
  const now = { ...NEW_MISSION, ...more, placing: { ...placing, ...fields } };
  return placementBody(here, now, 2, {}, now.placing);
}

test("who chooses nothing is asked for as the service takes it where nothing is named", () => {
  expect(bodyOf({})["goal"]).toEqual({ objective: "mean_error", on_surface: true, kind: "ranging", dop_limit: 5 });
});

test("dilutions are of the measure that the map shows", () => {
  const { measure } = positioning;
  expect(bodyOf({ objective: "dop", min_anchors: 3 })["goal"]).toMatchObject({ objective: "dop", min_anchors: 3, measure });
  expect(bodyOf({ objective: "dop" })["goal"]).not.toHaveProperty("on_surface");
});

test.each(["dop", "mean_error"] as const)("along the surface there is no measure of %s", (objective) => {
  const { goal } = bodyOf({ objective }, { positioning: { ...positioning, on_surface: true } });
  expect(goal).toMatchObject({ objective, on_surface: true });
  expect(goal).not.toHaveProperty("measure");
});

test("enough anchors are as many as a fix needs, and four to be covered, unless somebody says", () => {
  expect(enoughOf({ objective: "mean_error", min_anchors: null }, positioning)).toBe(2);
  expect(enoughOf({ objective: "dop", min_anchors: null }, positioning)).toBe(3);
  expect(enoughOf({ objective: "dop", min_anchors: null }, { ...positioning, on_surface: true })).toBe(2);
  expect(enoughOf({ objective: "coverage", min_anchors: null }, positioning)).toBe(4);
  expect(enoughOf({ objective: "dop", min_anchors: 5 }, positioning)).toBe(5);
});

test("places lie on a lattice over the area, wide where each takes a map of its signal, or are those that see most", () => {
  const area = [{ east_m: 0, north_m: 0 }, { east_m: 280, north_m: 0 }, { east_m: 280, north_m: 140 }];
  expect(bodyOf({})["candidates"]).toEqual([{ spacing_m: 100, above_ground_m: [100] }]);
  expect(spacingOf(here, { ...NEW_MISSION, area })).toBe(10);
  expect(spacingOf(here, { ...NEW_MISSION, anchors: [SENDS], positioning: { ...positioning, sight: "usable" } })).toBeCloseTo(2800 / 9);
  expect(spacingOf(here, { ...NEW_MISSION, placing: { ...placing, spacing_m: 70 } })).toBe(70);
  expect(bodyOf({ best_sites: 40, spacing_m: 70 })["candidates"]).toEqual([{ best_sites: 40, above_ground_m: [100] }]);
});
