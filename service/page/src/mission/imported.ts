// What a file of another program holds becomes part of the mission: points anchors, lines the route, areas no-go or keep-in.
import type { Imported, ImportedLine, ImportedPoint } from "../api/imports";
import { type Anchor, type Mission, newAnchor, nextId } from "./mission";

export type AreaUse = "no_go" | "keep_in" | "area";

function anchorOf(point: ImportedPoint, there: readonly Anchor[]): Anchor {
  const base = newAnchor(there, { east_m: point.east_m, north_m: point.north_m });
  const free = point.id !== "" && !there.some((one) => one.id === point.id);
  const fromGround = point.altitude_m === null;
  return {
    ...base,
    id: free ? point.id : nextId(there),
    kind: point.kind === "mast" || point.kind === "beacon" || point.kind === "drone" ? point.kind : base.kind,
    height_m: point.altitude_m ?? point.above_ground_m ?? base.height_m,
    height_from: fromGround ? "above_ground_m" : "altitude_m",
    max_range_m: point.max_range_m,
    azimuth_from_deg: point.azimuth_from_deg,
    azimuth_to_deg: point.azimuth_to_deg,
    ranging_sigma_m: point.ranging_sigma_m ?? base.ranging_sigma_m,
    radio: point.radio,
  };
}

/** Anchors of the points, after those that are there. */
export function anchorsFrom(found: Imported, there: readonly Anchor[]): readonly Anchor[] {
  const all = [...there];
  for (const point of found.points) all.push(anchorOf(point, all));
  return all;
}

/** A line as the route: its first corner the start, its last the goal. */
export function routeFrom(line: ImportedLine, mission: Mission): Pick<Mission, "route"> {
  const [start, ...rest] = line.places;
  const goal = rest.pop();
  return { route: { ...mission.route, start: start ?? null, goal: goal ?? null, way_points: rest } };
}

export function areaFrom(area: ImportedLine, use: AreaUse, mission: Mission): Partial<Mission> {
  if (use === "area") return { area: area.places };
  return { route: { ...mission.route, [use]: [...mission.route[use], area.places] } };
}

/** What the file itself says that an area is; null where it does not. */
export function useOf(area: ImportedLine): AreaUse | null {
  return area.what === "no-go" ? "no_go" : area.what === "keep-in" ? "keep_in" : area.what === "area" ? "area" : null;
}
