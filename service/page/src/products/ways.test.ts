import { expect, test } from "vitest";
import { EMPTY_ROUTE } from "../mission/mission";
import { routeAlong } from "./ways";

test("a route along a way passes its corners between start and goal, and seeks no others", () => {
  const at = (east_m: number): { east_m: number; north_m: number; lon_deg: number } => ({ east_m, north_m: 2, lon_deg: 9 });
  const route = { ...EMPTY_ROUTE, start: at(0), goal: at(3), way_points: [at(7)], alternatives: 3, min_anchors: 2 };
  expect(routeAlong(route, [at(0), at(1), at(2), at(3)])).toEqual({
    ...route,
    way_points: [{ east_m: 1, north_m: 2 }, { east_m: 2, north_m: 2 }],
    alternatives: 0,
  });
  expect(routeAlong(route, [at(0), at(3)]).way_points).toEqual([]);
});
