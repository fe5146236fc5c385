// The mission as a document: all that a planner decides, and nothing that is calculated from it. The service keeps it
// with the same fields (service/missions/document.py), and a test holds the two against each other.
import type { Place } from "../api/types";

export type Ring = readonly Place[];
export type Kind = "drone" | "mast" | "beacon";
export type HeightFrom = "above_ground_m" | "altitude_m";
/** Budgets of radio links that the service knows by name. */
export const RADIO_NAMES = ["uwb", "2.4GHz", "868MHz", "915MHz", "gnss-l1"] as const;
export type RadioName = (typeof RADIO_NAMES)[number];

export interface Anchor extends Place {
  readonly id: string;
  readonly kind: Kind;
  readonly height_m: number;
  readonly height_from: HeightFrom;
  readonly max_range_m: number | null;
  readonly azimuth_from_deg: number | null;
  readonly azimuth_to_deg: number | null;
  readonly ranging_sigma_m: number;
  /** What it sends by; null: only sight is known of it. */
  readonly radio: RadioName | null;
  /** Where it flies from its place, in order; none: it stands. */
  readonly flies_to: readonly Place[];
  readonly flies_m_per_s: number;
}

export interface GroundRef {
  readonly dem_id: string;
  readonly name: string;
  readonly sha256: string;
}

/** What stands on the ground: footprints with heights, whole, so that the mission tells all that it was calculated from. */
export interface Buildings {
  readonly name: string;
  /** A FeatureCollection, in degrees unless it says otherwise. */
  readonly geojson: Readonly<Record<string, unknown>>;
  /** Height of each storey where only these are told; null: such buildings are refused. */
  readonly level_m: number | null;
  /** Height of buildings that tell nothing; null: they are refused. */
  readonly default_height_m: number | null;
}

/** Trees over the ground: they hide nothing, and weaken the signals of radios. */
export interface Trees {
  /** One height everywhere, a raster of crown heights, or a surface model of which ground and buildings are taken out. */
  readonly what: "top" | "heights" | "surface";
  readonly top_m: number | null;
  /** The raster's file, whole; null: one height. */
  readonly name: string | null;
  readonly base64: string | null;
  readonly base_m: number;
  /** Optical depth per metre of way, 1/m; null: Weissberger's model. */
  readonly depth_per_m: number | null;
}

export interface Rover {
  readonly receiver_above_ground_m: number;
  readonly max_slope_deg: number;
  readonly footprint_radius_m: number;
  readonly speed_m_per_s: number;
}

export interface Positioning {
  readonly kind: "ranging" | "pseudorange" | "tdoa";
  readonly measure: "gdop" | "pdop" | "hdop" | "vdop";
  readonly dop_limit: number;
  readonly on_surface: boolean;
  /** Whether maps and read-out are of what is in sight, or of what arrives with enough power. */
  readonly sight: "visible" | "usable";
}

export interface Route {
  readonly start: Place | null;
  readonly goal: Place | null;
  readonly way_points: readonly Place[];
  readonly no_go: readonly Ring[];
  readonly keep_in: readonly Ring[];
  /** 0: no limit. */
  readonly min_anchors: number;
  /** Whether the dilution has to stay below its limit all along. */
  readonly keep_dop: boolean;
  readonly bubble_epsilon: number;
  /** So many other ways are sought as well. */
  readonly alternatives: number;
  /** When the rover leaves, on the clock of anchors that fly; with leave_by_s the soonest of the times that are tried. */
  readonly departure_s: number;
  readonly leave_by_s: number | null;
  /** null: whenever it gets there. */
  readonly arrive_by_s: number | null;
}

export interface Placing {
  readonly count: number;
  readonly above_ground_m: number;
  readonly objective: "coverage" | "dop" | "mean_error";
  /** null: as many as the service takes for the objective. */
  readonly min_anchors: number | null;
  readonly spacing_m: number | null;
  /** So many places that see most are tried, by a map of sites; null: a lattice. */
  readonly best_sites: number | null;
  readonly where: "area" | "path";
}

/** What anchors keep away from: a place, or a line, and how far. */
export interface StandOff {
  readonly places: readonly Place[];
  readonly distance_m: number;
}

/** Where anchors that are sought may be. */
export interface Rules {
  readonly no_fly: readonly Ring[];
  readonly stand_off: readonly StandOff[];
  readonly max_above_ground_m: number | null;
  readonly max_altitude_m: number | null;
  readonly max_range_m: number | null;
  readonly min_separation_m: number;
}

/** From where to where a drone flies through the air, at one height above the ground at both ends. */
export interface Flight {
  readonly start: Place | null;
  readonly goal: Place | null;
  readonly above_ground_m: number;
  /** Distance kept from ground and buildings. */
  readonly bubble_m: number;
  readonly speed_m_per_s: number;
}

/** A file of satellites' orbits, whole, so that the mission tells all that it was calculated from. */
export interface Orbits {
  readonly name: string;
  readonly what: "almanac" | "navigation";
  readonly text: string;
}

/** The times that are looked at: from second 0 on, which is an instant where satellites are ranged to. */
export interface Times {
  /** ISO 8601, UTC. */
  readonly begins_at: string | null;
  readonly lasts_s: number;
  readonly step_s: number;
  readonly orbits: Orbits | null;
}

export interface Mission {
  readonly version: 1;
  readonly name: string;
  readonly ground: GroundRef | null;
  readonly buildings: Buildings | null;
  readonly trees: Trees | null;
  /** Where the mission takes place; null: the whole DEM. */
  readonly area: Ring | null;
  readonly anchors: readonly Anchor[];
  readonly rover: Rover;
  readonly positioning: Positioning;
  readonly route: Route;
  readonly placing: Placing;
  readonly rules: Rules;
  readonly ceiling_above_ground_m: number;
  readonly times: Times;
  readonly flight: Flight;
}

export const EMPTY_ROUTE: Route = {
  start: null,
  goal: null,
  way_points: [],
  no_go: [],
  keep_in: [],
  min_anchors: 0,
  keep_dop: false,
  bubble_epsilon: 0,
  alternatives: 0,
  departure_s: 0,
  leave_by_s: null,
  arrive_by_s: null,
};

export const NEW_MISSION: Mission = {
  version: 1,
  name: "Mission",
  ground: null,
  buildings: null,
  trees: null,
  area: null,
  anchors: [],
  rover: { receiver_above_ground_m: 1.5, max_slope_deg: 25, footprint_radius_m: 0.8, speed_m_per_s: 0.5 },
  positioning: { kind: "ranging", measure: "hdop", dop_limit: 5, on_surface: false, sight: "visible" },
  route: EMPTY_ROUTE,
  placing: { count: 2, above_ground_m: 100, objective: "mean_error", min_anchors: null, spacing_m: null, best_sites: null, where: "area" },
  rules: { no_fly: [], stand_off: [], max_above_ground_m: null, max_altitude_m: null, max_range_m: null, min_separation_m: 0 },
  ceiling_above_ground_m: 300,
  times: { begins_at: null, lasts_s: 3600, step_s: 600, orbits: null },
  flight: { start: null, goal: null, above_ground_m: 120, bubble_m: 20, speed_m_per_s: 12 },
};

export const FIRST_HEIGHT_M = 120;
export const STANDS = { flies_to: [], flies_m_per_s: 5 } as const;
/** Of anchors of older missions. */
const LACKING = { ...STANDS, radio: null } as const;

/** A mission out of its document; fields that an older one lacks have their first values. */
export function missionOf(document: Partial<Mission> & { readonly format?: string }): Mission {
  const { format: _, ...given } = document;
  return {
    ...NEW_MISSION,
    ...given,
    rover: { ...NEW_MISSION.rover, ...given.rover },
    positioning: { ...NEW_MISSION.positioning, ...given.positioning },
    route: { ...EMPTY_ROUTE, ...given.route },
    placing: { ...NEW_MISSION.placing, ...given.placing },
    rules: { ...NEW_MISSION.rules, ...given.rules },
    times: { ...NEW_MISSION.times, ...given.times },
    flight: { ...NEW_MISSION.flight, ...given.flight },
    anchors: (given.anchors ?? []).map((anchor) => ({ ...LACKING, ...anchor })),
  };
}

export function nextId(anchors: readonly Anchor[], letter = "D"): string {
  const taken = new Set(anchors.map((anchor) => anchor.id));
  let number = 1;
  while (taken.has(`${letter}${number}`)) number += 1;
  return `${letter}${number}`;
}

export function newAnchor(anchors: readonly Anchor[], place: Place): Anchor {
  const last = anchors.at(-1);
  return {
    id: nextId(anchors),
    ...place,
    kind: last?.kind ?? "drone",
    height_m: last?.height_from === "above_ground_m" ? last.height_m : FIRST_HEIGHT_M,
    height_from: "above_ground_m",
    max_range_m: null,
    azimuth_from_deg: null,
    azimuth_to_deg: null,
    ranging_sigma_m: 0.1,
    radio: last?.radio ?? null,
    ...STANDS,
  };
}

/** An anchor as the service is asked about it. */
export function anchorBody(anchor: Anchor): Record<string, unknown> {
  return { ...antennaBody(anchor), east_m: anchor.east_m, north_m: anchor.north_m, [anchor.height_from]: anchor.height_m };
}

/** The same with its radio, where the signal is asked for besides sight. */
export function heardBody(anchor: Anchor): Record<string, unknown> {
  return { ...anchorBody(anchor), ...radioBody(anchor) };
}

export function radioBody({ radio }: Anchor): Record<string, unknown> {
  return radio === null ? {} : { radio };
}

/** The same without its place. */
export function antennaBody(anchor: Anchor): Record<string, unknown> {
  return {
    id: anchor.id,
    ranging_sigma_m: anchor.ranging_sigma_m,
    ...(anchor.max_range_m === null ? {} : { max_range_m: anchor.max_range_m }),
    ...(anchor.azimuth_from_deg === null ? {} : { azimuth_from_deg: anchor.azimuth_from_deg }),
    ...(anchor.azimuth_to_deg === null ? {} : { azimuth_to_deg: anchor.azimuth_to_deg }),
  };
}

/** What a question says of buildings, and of trees where it is about signals; nothing where nothing stands. */
export function coverBody(buildings: Buildings | null, trees: Trees | null = null): Record<string, unknown> {
  const cover = { ...(buildings && footprintsBody(buildings)), ...(trees && { canopy: canopyBody(trees) }) };
  return Object.keys(cover).length === 0 ? {} : { cover };
}

function footprintsBody({ geojson, level_m, default_height_m }: Buildings): Record<string, unknown> {
  return { footprints: { geojson, level_m, default_height_m } };
}

function canopyBody({ what, top_m, name, base64, base_m, depth_per_m }: Trees): Record<string, unknown> {
  const crowns = what === "top" ? { top_m } : { [what]: { name, base64 } };
  return { ...crowns, base_m, ...(depth_per_m === null ? {} : { model: "density", depth_per_m }) };
}


export function isLimited(anchor: Anchor): boolean {
  return anchor.max_range_m !== null || anchor.azimuth_from_deg !== null || anchor.azimuth_to_deg !== null;
}
