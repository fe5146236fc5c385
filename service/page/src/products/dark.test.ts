import { expect, test } from "vitest";
import { darkStretches } from "./dark";
import type { Vertex } from "./path";

const along = (...counts: number[]): Vertex[] => counts.map((anchor_count, number) => ({ anchor_count, distance_m: 10 * number }) as Vertex);

test("stretches with too few anchors in sight begin and end where they do, also at the ends of the path", () => {
  const found = darkStretches(along(2, 3, 3, 2, 0, 3, 1), 3).map(({ from, to, fewest }) => [from.distance_m, to.distance_m, fewest]);
  expect(found).toEqual([
    [0, 0, 2],
    [30, 40, 0],
    [60, 60, 1],
  ]);
  expect(darkStretches(along(3, 4), 3)).toEqual([]);
});
