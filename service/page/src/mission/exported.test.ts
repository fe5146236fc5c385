import { expect, test } from "vitest";
import { leftBehind, leftBehindTold } from "./exported";
import { newAnchor } from "./mission";

const plain = newAnchor([], { east_m: 1, north_m: 2 });
const rich = { ...plain, radio: "868MHz", kind: "mast", max_range_m: 900, azimuth_from_deg: 10, azimuth_to_deg: 90 } as const;

test("tables and KML take all but flights along, a plan only places", () => {
  expect(leftBehind("anchors.csv", [rich])).toEqual([]);
  expect(leftBehind("mission.kmz", [{ ...rich, flies_to: [{ east_m: 3, north_m: 4 }] }])).toEqual(["flights"]);
  expect(leftBehind("anchors.plan", [plain])).toEqual(["ids"]);
  expect(leftBehind("mission.gpx", [plain, rich])).toEqual(["radios", "ranges", "sectors"]);
});

test("what stays behind is told, and nothing where all goes along", () => {
  expect(leftBehindTold("anchors.csv", [rich])).toBeNull();
  expect(leftBehindTold("mission.gpx", [rich])).toBe("mission.gpx has no place for radios, longest ranges and sectors of anchors: they stay in the mission alone.");
});
