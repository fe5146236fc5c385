import { expect, test } from "vitest";
import { frameOf } from "../geo/frames";
import type { Dem } from "../api/types";
import { outlinesOf } from "./buildings";

const UTM = frameOf({ crs: "EPSG:32632", body: "Earth" } as Dem);
const square = (x: number, y: number, side: number) => [[[x, y], [x + side, y], [x + side, y + side], [x, y + side], [x, y]]];
const town = (geometry: object, more = {}) => ({
  name: "town.geojson", level_m: null, default_height_m: null,
  geojson: { type: "FeatureCollection", ...more, features: [{ type: "Feature", properties: { building: "yes", height: 9 }, geometry }] },
});

test("outlines in degrees come into the metres of the ground, those in metres stay", () => {
  const [here] = outlinesOf(town({ type: "Polygon", coordinates: square(9, 46, 0.001) }), UTM);
  // the central meridian of zone 32 lies at 9 degrees east, 500 km east
  expect(here?.[0]?.east_m).toBeCloseTo(500_000, 3);
  expect(here).toHaveLength(5);
  const [metres] = outlinesOf(town({ type: "Polygon", coordinates: square(10, 20, 5) }, { coordinates_are: "metres" }), UTM);
  expect(metres?.[2]).toEqual({ east_m: 15, north_m: 25 });
});

test("of several polygons each is an outline", () => {
  const both = { type: "MultiPolygon", coordinates: [square(9, 46, 0.001), square(9.01, 46, 0.001)] };
  expect(outlinesOf(town(both), UTM)).toHaveLength(2);
});
