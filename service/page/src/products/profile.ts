// Profiles: the ground below a line of sight or along the path, for the drawer under the map.
import { signal } from "@preact/signals";
import { passing } from "../api/jobs";
import type { LineAnswer, Place } from "../api/types";
import { ask } from "../api/http";
import { heightAt } from "../geo/grid";
import type { Anchor } from "../mission/mission";
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
  readonly curves: readonly { readonly name: string; readonly heightM: readonly (number | null)[]; readonly ground?: boolean }[];
}

export const profile = signal<Profile | null>(null);
export const markedPlace = signal<Place | null>(null);
const SAMPLES = 400;
const FREQUENCY_HZ = 2.4e9;

const known = (value: number): number | null => (Number.isNaN(value) ? null : value);

/** The ground between a place and an anchor, the line between their antennas, and the service's verdict on it. */
export async function profileTo(place: Place, anchor: Anchor): Promise<void> {
  const here = ground.peek();
  if (!here) throw new Error(words.chooseGround);
  const receiverM = mission.peek().rover.receiver_above_ground_m;
  const to = { east_m: anchor.east_m, north_m: anchor.north_m, [anchor.height_from]: anchor.height_m };
  const body = {
    dem_id: here.dem.id,
    frequency_hz: FREQUENCY_HZ,
    pairs: [{ from: { ...place, above_ground_m: receiverM }, to }],
  };
  const [line] = await passing<unknown, readonly LineAnswer[]>("/lines-of-sight", body, async (job) => {
    const whole = (await (await ask(job.links.self)).json()) as { lines: readonly LineAnswer[] };
    return whole.lines;
  });
  const places = Array.from({ length: SAMPLES + 1 }, (_, at) => between(place, anchor, at / SAMPLES));
  const whole = Math.hypot(anchor.east_m - place.east_m, anchor.north_m - place.north_m);
  const groundM = places.map((one) => heightAt(here, one));
  const from = (groundM[0] ?? NaN) + receiverM;
  const end = anchor.height_from === "altitude_m" ? anchor.height_m : (groundM.at(-1) ?? NaN) + anchor.height_m;
  profile.value = {
    title: words.ui.profileOf(anchor.id),
    note: line ? noteOf(line, place) : "",
    places,
    distanceM: places.map((_, at) => (whole * at) / SAMPLES),
    curves: [
      { name: words.ui.ground, heightM: groundM.map(known), ground: true },
      { name: words.ui.line, heightM: places.map((_, at) => known(from + ((end - from) * at) / SAMPLES)) },
    ],
  };
}

function noteOf(line: LineAnswer, from: Place): string {
  const parts = [words.ui.clearance(words.verdict(line.verdict), length(line.clearance_m))];
  const at = line.blocking_point;
  if (at) parts.push(words.ui.blockedBy(distance(Math.hypot(at.east_m - from.east_m, at.north_m - from.north_m)), length(at.altitude_m, 0)));
  if (line.fresnel_clearance !== null) parts.push(words.ui.fresnel(figure(line.fresnel_clearance, 1)));
  return `${parts.join("; ")}.`;
}

export function profileOfPath(): void {
  const line = pathLine.peek();
  profile.value = {
    title: words.ui.profilePath,
    note: "",
    places: line,
    distanceM: line.map((vertex) => vertex.distance_m),
    curves: [{ name: words.ui.ground, heightM: line.map((vertex) => known(vertex.altitude_m)), ground: true }],
  };
}

function between(from: Place, to: Place, share: number): Place {
  return {
    east_m: from.east_m + share * (to.east_m - from.east_m),
    north_m: from.north_m + share * (to.north_m - from.north_m),
  };
}
