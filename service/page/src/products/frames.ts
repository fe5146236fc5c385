// What satellites and anchors that fly make of the air from time to time: a morphing map for each frame.
import { computed, signal } from "@preact/signals";
import { calculate } from "../api/jobs";
import type { FrameFacts, FramesAnswer, LayerLink, Place } from "../api/types";
import type { Ground } from "../geo/grid";
import { bytesOf, floatsOf } from "../geo/rasters";
import { isHeard, sightBody } from "../mission/hearing";
import { type Anchor, antennaBody, type Mission, type Orbits, radioBody } from "../mission/mission";
import { change, ground, mission, overlay } from "../state";
import { words } from "../words";
import type { AirColumns } from "./air";
import { working } from "./working";

export interface Frame extends AirColumns {
  readonly facts: FrameFacts;
}

export interface Frames {
  readonly key: string;
  readonly all: readonly Frame[];
  readonly answer: FramesAnswer;
  readonly downloads: readonly LayerLink[];
}

export const frames = signal<Frames | null>(null);
/** Number of the frame that is looked at. */
export const frameShown = signal(0);
export const frame = computed<Frame | null>(() => frames.value?.all[frameShown.value] ?? null);
/** So many values are kept of all frames together. */
const MOST_VALUES = 60_000_000;
/** So many places are told of a flight. */
const MOST_LEGS = 2000;

/** Bytes of a file of orbits, which is kept within the mission. */
const MOST_ORBITS = 600_000;

export const flies = (anchor: Anchor): boolean => anchor.flies_to.length > 0;

/** Where an anchor that flies is when, one place after the other; it waits at the last. */
function flightOf(anchor: Anchor): (Place & { readonly time_s: number })[] {
  const points = [{ east_m: anchor.east_m, north_m: anchor.north_m, time_s: 0 }];
  for (const place of anchor.flies_to) {
    const last = points[points.length - 1] as (typeof points)[number];
    const metres = Math.hypot(place.east_m - last.east_m, place.north_m - last.north_m);
    // the same place twice is one place, and no time passes
    if (metres > 0) points.push({ ...place, time_s: last.time_s + metres / anchor.flies_m_per_s });
  }
  return points;
}

export function placeAt(anchor: Anchor, timeS: number): Place {
  const points = flightOf(anchor);
  const next = points.findIndex(({ time_s }) => time_s > timeS);
  if (next <= 0) return points[next === 0 ? 0 : points.length - 1] as Place;
  const [from, to] = [points[next - 1], points[next]] as [(typeof points)[number], (typeof points)[number]];
  const part = (timeS - from.time_s) / (to.time_s - from.time_s);
  return { east_m: from.east_m + part * (to.east_m - from.east_m), north_m: from.north_m + part * (to.north_m - from.north_m) };
}

/** So long a drone waits where its flight ends, for a path that is still under way; seconds. */
const WAITS_S = 7 * 86_400;

/** Places so close together that a height above the ground follows the ground between them, as drones do. */
function trackBody(anchor: Anchor, lastsS: number, cellM: number, heard: boolean): Record<string, unknown> {
  const points = flightOf(anchor);
  const last = points[points.length - 1] as (typeof points)[number];
  const everyS = Math.max(cellM / anchor.flies_m_per_s, last.time_s / MOST_LEGS);
  const all = points.flatMap((point, at) => {
    const next = points[at + 1];
    const legs = next ? Math.ceil((next.time_s - point.time_s) / everyS) : 1;
    return Array.from({ length: legs }, (_, leg) => {
      const time_s = next ? point.time_s + (leg / legs) * (next.time_s - point.time_s) : point.time_s;
      return { ...placeAt(anchor, time_s), time_s };
    });
  });
  if (last.time_s < lastsS) all.push({ ...last, time_s: lastsS });
  return { ...antennaBody(anchor), ...(heard ? radioBody(anchor) : {}), points: all.map((point) => ({ ...point, [anchor.height_from]: anchor.height_m })) };
}

/** What a question about one time after the other says of the anchors that fly; they wait at their last places. */
export function tracksBody(anchors: readonly Anchor[], cellM: number, heard: boolean, untilS = WAITS_S): Record<string, unknown>[] {
  return anchors.filter(flies).map((one) => trackBody(one, untilS, cellM, heard));
}

function satellitesBody({ begins_at, orbits }: Mission["times"]): Record<string, unknown> {
  if (orbits === null) return {};
  if (begins_at === null) throw new Error(words.noBegin);
  return { satellites: { [orbits.what]: orbits.text, time: begins_at, reference_date: begins_at.slice(0, 10) } };
}

/** Whether the frames are of usable signals: nobody knows that of satellites, and with these they are of what is in sight. */
export function areFramesHeard(now: Mission): boolean {
  return isHeard(now) && now.times.orbits === null;
}

function question(): Record<string, unknown> {
  const { anchors, positioning, rover, times, ceiling_above_ground_m } = mission.value;
  const here = ground.value;
  if (!here) throw new Error(words.chooseGround);
  if (anchors.length === 0 && times.orbits === null) throw new Error(words.nothingToRangeTo);
  const heard = areFramesHeard(mission.value);
  return {
    dem_id: here.dem.id,
    ...sightBody(mission.value, { anchors: anchors.filter((one) => !flies(one)), heard }),
    tracks: tracksBody(anchors, here.dem.cell_east_m, heard, times.lasts_s),
    ...satellitesBody(times),
    kind: positioning.kind,
    measure: positioning.measure,
    dop_limit: positioning.dop_limit,
    receiver_above_ground_m: rover.receiver_above_ground_m,
    ceiling_above_ground_m,
    frames: { to_s: times.lasts_s, step_s: times.step_s, above_ground_m: rover.receiver_above_ground_m },
    mode: "fast",
  };
}

export function areFramesCurrent(): boolean {
  try {
    return frames.value?.key === JSON.stringify(question());
  } catch {
    return false; // what they were asked with was taken away since
  }
}

export async function askForFrames(): Promise<void> {
  const body = question();
  const here = ground.peek() as Ground;
  const { lasts_s, step_s } = mission.peek().times;
  const count = Math.floor(lasts_s / step_s) + 1;
  const most = Math.floor(MOST_VALUES / here.heights.heightsM.length);
  if (count > most) throw new Error(words.tooManyFrames(count, most));
  await working("frames", async (following) => {
    const job = await calculate<FramesAnswer>("/morphing-maps", body, following);
    const [altitudes, states] = await Promise.all([floatsOf(job, "frames_altitude.tif", here), bytesOf(job, "frames_state.tif", here)]);
    const all = job.result.over_time.frames.map((facts, number) => ({
      facts,
      aboveGroundM: aboveGround(here, altitudes[number] as Float32Array),
      state: states[number] as Uint8Array,
    }));
    frameShown.value = 0;
    frames.value = { key: JSON.stringify(body), all, answer: job.result, downloads: job.layers };
    overlay.value = "frame";
  });
}

function aboveGround(here: Ground, altitudeM: Float32Array): Float32Array {
  const { heightsM } = here.heights;
  return altitudeM.map((altitude, at) => Math.max(0, altitude - (heightsM[at] as number)));
}

/** An almanac or a RINEX navigation file, by what its first lines say. */
export async function takeOrbits(file: File): Promise<void> {
  if (file.size > MOST_ORBITS) throw new Error(words.orbitsTooLarge(file.name, MOST_ORBITS));
  const text = await file.text();
  const what: Orbits["what"] = /RINEX VERSION/.test(text.slice(0, 400)) ? "navigation" : "almanac";
  change({ times: { ...mission.peek().times, orbits: { name: file.name, what, text } } });
}
