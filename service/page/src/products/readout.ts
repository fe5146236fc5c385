// Who is in sight of a place, and by how much: read from the arrays that are here already, without a request.
import type { Place } from "../api/types";
import { cellAt, type Ground, heightAt, postAt, slopeAt } from "../geo/grid";
import type { Anchor } from "../mission/mission";
import { frame, ground, mission } from "../state";
import type { Degrees } from "../geo/frames";
import { dilution, isDilutionCurrent } from "./dilution";
import { isCurrent, NEVER_MM, surfaces, UNKNOWN_MM } from "./surfaces";

export type Verdict = "seen" | "hidden" | "unknown";

export interface Sight {
  readonly anchor: Anchor;
  readonly verdict: Verdict;
  /** Antenna above the lowest altitude in sight, metres; negative: hidden by so much; NaN unknown. */
  readonly marginM: number;
  readonly distanceM: number;
}

export interface Readout {
  readonly place: Place;
  readonly degrees: Degrees | null;
  readonly heightM: number;
  readonly slopeDeg: number;
  readonly sight: readonly Sight[];
  /** NaN unknown, +Infinity no fix, null not calculated for the mission as it is. */
  readonly dop: number | null;
}

export function readoutAt(place: Place): Readout | null {
  const here = ground.value;
  const cell = here && cellAt(here, place);
  if (!here || !cell) return null;
  const index = postAt(here, cell.row, cell.col);
  return {
    place,
    degrees: frame.value?.toDegrees(place) ?? null,
    heightM: heightAt(here, place),
    slopeDeg: slopeAt(here, place),
    sight: sightOf(place),
    dop: isDilutionCurrent() ? (dilution.value?.dop[index] ?? null) : null,
  };
}

export function sightOf(place: Place): Sight[] {
  const here = ground.value;
  const cell = here && cellAt(here, place);
  if (!here || !cell) return [];
  const index = postAt(here, cell.row, cell.col);
  return mission.value.anchors.flatMap((anchor) => {
    const one = sightOfOne(here, anchor, place, index);
    return one === null ? [] : [one];
  });
}

function sightOfOne(here: Ground, anchor: Anchor, place: Place, index: number): Sight | null {
  const surface = surfaces.value.get(anchor.id);
  if (!surface || !isCurrent(here.dem, anchor)) return null;
  const neededMm = surface.neededMm[index] as number;
  const exactM = mission.value.rover.receiver_above_ground_m - neededMm / 1000;
  const marginM = neededMm === UNKNOWN_MM ? NaN : neededMm === NEVER_MM ? -Infinity : exactM;
  const verdict = Number.isNaN(marginM) ? "unknown" : marginM >= 0 ? "seen" : "hidden";
  const distanceM = Math.hypot(anchor.east_m - place.east_m, anchor.north_m - place.north_m);
  return { anchor, verdict, marginM, distanceM };
}
