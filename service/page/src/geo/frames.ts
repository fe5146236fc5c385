// Between the metres of a DEM and the degrees of its body.
import proj4 from "proj4";
import type { Dem, Place } from "../api/types";

export interface Degrees {
  readonly lon_deg: number;
  readonly lat_deg: number;
}

export interface Frame {
  toDegrees(place: Place): Degrees | null;
  toMetres(degrees: Degrees): Place | null;
}

const NONE: Frame = { toDegrees: () => null, toMetres: () => null };
const UTM = /^EPSG:32([67])(\d\d)$/;

/** The frame of a DEM; one without CRS, or whose CRS is not understood here, has no degrees. */
export function frameOf(dem: Dem): Frame {
  const definition = dem.crs_proj ?? dem.crs_wkt ?? definitionOf(dem.crs);
  if (definition === null) return NONE;
  let metres: ReturnType<typeof proj4.Proj>;
  try {
    metres = proj4.Proj(definition);
  } catch (error) {
    console.warn(`The page cannot read this CRS: ${definition}`, error);
    return NONE;
  }
  // degrees of the DEM's own body, on its own ellipsoid, so that no datum is shifted
  const { a, b } = metres as unknown as { a: number; b: number };
  const degrees = dem.body === "Earth" ? "+proj=longlat +datum=WGS84 +no_defs" : `+proj=longlat +a=${a} +b=${b} +no_defs`;
  const between = proj4(degrees, definition);
  return {
    toDegrees: (place) => {
      const [lon, lat] = between.inverse([place.east_m, place.north_m]);
      return Number.isFinite(lon + lat) ? { lon_deg: lon, lat_deg: lat } : null;
    },
    toMetres: ({ lon_deg, lat_deg }) => {
      const [east, north] = between.forward([lon_deg, lat_deg]);
      return Number.isFinite(east + north) ? { east_m: east, north_m: north } : null;
    },
  };
}

function definitionOf(crs: string | null): string | null {
  if (crs === null) return null;
  const utm = UTM.exec(crs);
  if (utm) return `+proj=utm +zone=${Number(utm[2])}${utm[1] === "7" ? " +south" : ""} +datum=WGS84 +units=m +no_defs`;
  // proj4 reads WKT and PROJ strings by itself, but of codes only what it has been told
  return /^[A-Za-z_]+:\w+$/.test(crs) ? null : crs;
}
