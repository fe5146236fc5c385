// A drone's flight from place to place: above the morphing map, below the ceiling, clear of the ground.
import { computed, signal } from "@preact/signals";
import { askText } from "../api/http";
import { calculate, layer } from "../api/jobs";
import type { FlightAnswer, LayerLink, Place } from "../api/types";
import { sightBody } from "../mission/hearing";
import type { Mission } from "../mission/mission";
import { tableOf } from "../mission/tables";
import { ground, mission } from "../state";
import { words } from "../words";
import { profile } from "./profile";
import { working } from "./working";

export interface PlannedFlight {
  readonly key: string;
  readonly answer: FlightAnswer;
  /** Fine steps: along the flight, how high it is, the ground, and from where up positioning is good enough; NaN unknown. */
  readonly air: readonly { readonly distanceM: number; readonly altitudeM: number; readonly groundM: number; readonly floorM: number }[];
  readonly downloads: readonly LayerLink[];
}

export const flight = signal<PlannedFlight | null>(null);
export const flown = computed<readonly Place[]>(() => flight.value?.answer.corners ?? []);
const SECONDS = 30;

function question(now: Mission): Record<string, unknown> {
  const here = ground.value;
  const { start, goal, above_ground_m, bubble_m, speed_m_per_s } = now.flight;
  if (!here) throw new Error(words.chooseGround);
  if (!start) throw new Error(words.noTakeOff);
  if (!goal) throw new Error(words.noLanding);
  const { cover, ...ranged } = sightBody(now);
  const { kind, measure, dop_limit } = now.positioning;
  const { ceiling_above_ground_m, rover } = now;
  const above = { ...ranged, kind, measure, dop_limit, receiver_above_ground_m: rover.receiver_above_ground_m, ceiling_above_ground_m, mode: "fast" };
  return {
    dem_id: here.dem.id,
    ...(cover === undefined ? {} : { cover }),
    start: { ...start, above_ground_m },
    goal: { ...goal, above_ground_m },
    // without anchors there is no morphing map, and the air has its ceiling still
    ...(now.anchors.length === 0 ? { ceiling_above_ground_m } : { morphing_map: above }),
    bubble_m,
    speed_m_per_s,
    budget: { seconds: SECONDS },
  };
}

export function isFlightCurrent(): boolean {
  try {
    return flight.value?.key === JSON.stringify(question(mission.value));
  } catch {
    return false; // an end was taken away since
  }
}

export async function planFlight(): Promise<void> {
  const body = question(mission.peek());
  await working("flight", async (following) => {
    const job = await calculate<FlightAnswer>("/flights", body, following);
    const rows = job.result.totals === null ? [] : tableOf(await askText(layer(job, "flight.csv")));
    flight.value = { key: JSON.stringify(body), answer: job.result, air: rows.map(stepOf), downloads: job.layers };
  });
}

function stepOf(row: Readonly<Record<string, string>>): PlannedFlight["air"][number] {
  const number = (name: string): number => (row[name] ? Number(row[name]) : NaN);
  return { distanceM: number("distance_m"), altitudeM: number("altitude_m"), groundM: number("ground_m"), floorM: number("floor_m") };
}

/** Ground, morphing map and flight in the drawer under the map. */
export function profileOfFlight({ air, answer }: PlannedFlight): void {
  const known = (metres: number): number | null => (Number.isNaN(metres) ? null : metres);
  profile.value = {
    title: words.ui.flightProfile,
    note: "",
    places: air.map(({ distanceM }) => alongAt(answer.corners, distanceM)),
    distanceM: air.map(({ distanceM }) => distanceM),
    curves: [
      { name: words.ui.ground, heightM: air.map(({ groundM }) => known(groundM)), what: "ground" },
      { name: words.ui.flownAt, heightM: air.map(({ altitudeM }) => altitudeM) },
      ...((answer.totals?.margin_m ?? null) === null ? [] : [{ name: words.ui.floor, heightM: air.map(({ floorM }) => known(floorM)) }]),
    ],
  };
}

/** The place so far along the corners of a flight, metres through the air. */
export function alongAt(corners: FlightAnswer["corners"], distanceM: number): Place {
  let left = distanceM;
  for (let at = 1; at < corners.length; at += 1) {
    const [from, to] = [corners[at - 1], corners[at]] as [FlightAnswer["corners"][number], FlightAnswer["corners"][number]];
    const legM = Math.hypot(to.east_m - from.east_m, to.north_m - from.north_m, to.altitude_m - from.altitude_m);
    if (left <= legM || at === corners.length - 1) {
      const share = legM === 0 ? 0 : Math.min(1, left / legM);
      return { east_m: from.east_m + share * (to.east_m - from.east_m), north_m: from.north_m + share * (to.north_m - from.north_m) };
    }
    left -= legM;
  }
  return { east_m: NaN, north_m: NaN };
}
