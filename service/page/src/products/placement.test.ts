import { expect, test } from "vitest";
import type { Ground } from "../geo/grid";
import { NEW_MISSION } from "../mission/mission";
import { placementBody } from "./placement";

const here = { dem: { id: "g" }, extent: { west: 0, south: 0, east: 2800, north: 1400 } } as Ground;
const goalOf = (objective: "coverage" | "dop" | "mean_error", min_anchors = 3): unknown =>
  placementBody(here, NEW_MISSION, 2, {}, { objective, min_anchors }).goal;

test("dilutions are of the measure that the map shows", () => {
  const { measure } = NEW_MISSION.positioning;
  expect(goalOf("dop")).toMatchObject({ objective: "dop", min_anchors: 3, measure });
});

test("an error is along the surface, where no other measure is defined", () => {
  const goal = goalOf("mean_error");
  expect(goal).toMatchObject({ objective: "mean_error", min_anchors: 3, on_surface: true });
  expect(goal).not.toHaveProperty("measure");
});
