import { expect, test } from "vitest";
import { NEW_MISSION } from "../mission/mission";
import { darkStretches, fixNeeds } from "./dark";
import type { Vertex } from "./path";

const along = (...counts: number[]): Vertex[] => counts.map((anchor_count, number) => ({ anchor_count, distance_m: 10 * number }) as Vertex);

test("a stretch runs from the last place in sight to the next one, also at the ends of the path", () => {
  const found = darkStretches(along(2, 3, 3, 2, 0, 3, 3, 1), 3).map(({ from, to, fewest }) => [from.distance_m, to.distance_m, fewest]);
  expect(found).toEqual([
    [0, 10, 2],
    [20, 50, 0],
    [60, 70, 1],
  ]);
  expect(darkStretches(along(3, 4), 3)).toEqual([]);
});

test("a fix needs as many anchors as there are unknowns", () => {
  const { positioning } = NEW_MISSION;
  expect(fixNeeds(positioning)).toBe(3);
  expect(fixNeeds({ ...positioning, on_surface: true })).toBe(2);
  expect(fixNeeds({ ...positioning, kind: "pseudorange" })).toBe(4);
});
