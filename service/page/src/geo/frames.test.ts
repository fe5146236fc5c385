import { expect, test } from "vitest";
import type { Dem } from "../api/types";
import { frameOf } from "./frames";

const MOON =
  'PROJCRS["Moon",BASEGEOGCRS["Moon",DATUM["Moon",ELLIPSOID["Moon",1737400,0,LENGTHUNIT["metre",1]]],PRIMEM["Reference",0,ANGLEUNIT["degree",0.0174532925199433]]],' +
  'CONVERSION["unnamed",METHOD["Azimuthal Equidistant"],PARAMETER["Latitude of natural origin",-85,ANGLEUNIT["degree",0.0174532925199433]],PARAMETER["Longitude of natural origin",30,ANGLEUNIT["degree",0.0174532925199433]],PARAMETER["False easting",0,LENGTHUNIT["metre",1]],PARAMETER["False northing",0,LENGTHUNIT["metre",1]]],' +
  'CS[Cartesian,2],AXIS["easting",east,LENGTHUNIT["metre",1]],AXIS["northing",north,LENGTHUNIT["metre",1]]]';

test("UTM by its code: the middle of zone 32 is at 9 degrees east", () => {
  const frame = frameOf({ crs: "EPSG:32632", body: "Earth" } as Dem);
  expect(frame.toDegrees({ east_m: 500000, north_m: 0 })?.lon_deg).toBeCloseTo(9, 9);
  expect(frame.toMetres({ lon_deg: 9, lat_deg: 0 })?.east_m).toBeCloseTo(500000, 4);
});

test("the Moon by its WKT: its origin is where it says, and a degree of latitude is as long as on that sphere", () => {
  const frame = frameOf({ crs: MOON, body: "Moon" } as Dem);
  const origin = frame.toDegrees({ east_m: 0, north_m: 0 });
  expect([origin?.lon_deg, origin?.lat_deg]).toEqual([expect.closeTo(30, 6), expect.closeTo(-85, 6)]);
  const north = frame.toMetres({ lon_deg: 30, lat_deg: -84 });
  expect(north?.north_m).toBeCloseTo((Math.PI / 180) * 1737400, 0);
});

test("a local frame has no degrees", () => {
  expect(frameOf({ crs: null, body: null } as Dem).toDegrees({ east_m: 0, north_m: 0 })).toBeNull();
});
