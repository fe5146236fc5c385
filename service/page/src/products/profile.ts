// Profiles: the ground below a line of sight or along the path, for the drawer under the map.
import { signal } from "@preact/signals";
import { askJson, posted } from "../api/http";
import type { Place, ProfileAnswer } from "../api/types";
import { type Anchor, coverBody, radioBody } from "../mission/mission";
import { ground, mission } from "../state";
import { distance, figure, length } from "../units";
import { words } from "../words";
import { pathLine } from "./path";

export interface Profile {
  readonly title: string;
  readonly note: string;
  readonly places: readonly Place[];
  readonly distanceM: readonly number[];
  /** Named curves over the distance, metres of height; null where unknown. */
  readonly curves: readonly { readonly name: string; readonly heightM: readonly (number | null)[]; readonly what?: "ground" | "roofs" | "crowns" | "bases" }[];
}

export const profile = signal<Profile | null>(null);
export const markedPlace = signal<Place | null>(null);
/** A pointer over the map is at the profile within this share of its length. */
const NEAR = 0.05;
const WAVELENGTH_M = 0.125;
const WAIT_S = 5;

const known = (value: number): number | null => (Number.isNaN(value) ? null : value);

/** Ground, line, first Fresnel zone and verdict between a place and an anchor, as the service answers them. */
export async function profileTo(place: Place, anchor: Anchor): Promise<void> {
  const here = ground.peek();
  if (!here) throw new Error(words.chooseGround);
  const { buildings, trees, rover } = mission.peek();
  const above_ground_m = rover.receiver_above_ground_m;
  const to = { east_m: anchor.east_m, north_m: anchor.north_m, [anchor.height_from]: anchor.height_m };
  const body = { dem_id: here.dem.id, ...coverBody(buildings, trees), ...(anchor.radio === null ? { wavelength_m: WAVELENGTH_M } : radioBody(anchor)), pairs: [{ from: { ...place, above_ground_m }, to }] };
  const answer = await askJson<{ profiles: readonly [ProfileAnswer] }>("/profiles", posted(body, WAIT_S));
  const [line] = answer.profiles;
  const whole = line.distance_m.at(-1) ?? 0;
  const zone = line.fresnel_radius_m;
  profile.value = {
    title: words.ui.profileOf(anchor.id),
    note: noteOf(line, anchor),
    places: line.distance_m.map((metres) => between(place, anchor, whole === 0 ? 0 : metres / whole)),
    distanceM: line.distance_m,
    curves: [
      { name: words.ui.ground, heightM: line.ground_m, what: "ground" },
      ...(line.roof_m ? [{ name: words.ui.roofs, heightM: line.roof_m, what: "roofs" as const }] : []),
      ...(line.canopy_base_m && line.canopy_top_m
        ? [{ name: words.ui.crowns, heightM: line.canopy_top_m, what: "crowns" as const }, { name: words.ui.bases, heightM: line.canopy_base_m, what: "bases" as const }]
        : []),
      { name: words.ui.line, heightM: line.line_m },
      ...(zone ? [{ name: words.ui.zone, heightM: line.line_m.map((metres, at) => metres - (zone[at] ?? 0)) }] : []),
    ],
  };
}

function noteOf(line: ProfileAnswer, { radio }: Anchor): string {
  const parts = [words.ui.clearance(words.verdict(line.verdict), length(line.clearance_m))];
  if (line.blocking_point && line.blocking_distance_m !== null) {
    parts.push(words.ui.blockedBy(distance(line.blocking_distance_m), length(line.blocking_point.altitude_m, 0), isRoof(line, line.blocking_distance_m, line.blocking_point.altitude_m)));
  }
  if (line.fresnel_clearance !== null) parts.push(words.ui.fresnel(figure(line.fresnel_clearance, 1), words.ui.radios[radio ?? "2.4GHz"]));
  if (line.signal) {
    const { margin_db, probability, diffraction_db, canopy_m, canopy_db } = line.signal;
    parts.push(words.ui.signal(words.heard(margin_db, probability), diffraction_db, canopy_m ? length(canopy_m, 0) : null, canopy_db));
  }
  return `${parts.join("; ")}.`;
}

/** Whether what blocks at a distance and altitude is a roof, and not the ground. */
function isRoof({ distance_m, roof_m }: ProfileAnswer, blockedM: number, altitudeM: number): boolean {
  const near = distance_m.flatMap((metres, at) => (Math.abs(metres - blockedM) < 0.01 ? [roof_m?.[at] ?? NaN] : []));
  return near.some((roof) => Math.abs(roof - altitudeM) < 0.01);
}

export function profileOfPath(): void {
  const line = pathLine.peek();
  profile.value = {
    title: words.ui.profilePath,
    note: "",
    places: line,
    distanceM: line.map((vertex) => vertex.distance_m),
    curves: [{ name: words.ui.ground, heightM: line.map((vertex) => known(vertex.altitude_m)), what: "ground" }],
  };
}

/** How far along the profile the place nearest to a pointer lies, metres; null where none is near. */
export function alongOf({ places, distanceM }: Pick<Profile, "places" | "distanceM">, pointer: Place): number | null {
  let [nearest, leastM] = [-1, NEAR * (distanceM.at(-1) ?? 0)];
  places.forEach((place, number) => {
    const metres = Math.hypot(place.east_m - pointer.east_m, place.north_m - pointer.north_m);
    if (metres <= leastM) [nearest, leastM] = [number, metres];
  });
  return distanceM[nearest] ?? null;
}

function between(from: Place, to: Place, share: number): Place {
  return {
    east_m: from.east_m + share * (to.east_m - from.east_m),
    north_m: from.north_m + share * (to.north_m - from.north_m),
  };
}
