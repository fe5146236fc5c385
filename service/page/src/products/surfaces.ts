// What each anchor sees: the lowest altitude in its sight over every post, asked for by itself and kept, so that only
// what moved is calculated again and the antenna's height is a slider.
import { effect, signal } from "@preact/signals";
import { layer, passing } from "../api/jobs";
import type { Dem, Summary, VisibilityAnswer } from "../api/types";
import { rasterAt } from "../geo/rasters";
import { type Anchor, anchorBody, isLimited } from "../mission/mission";
import { accept, dem, mission, refuse, setBusy } from "../state";

export interface Surface {
  readonly key: string;
  /** Lowest altitude in sight, metres; NaN unknown, +Infinity at none. */
  readonly altitudeM: Float32Array;
  /** 1 visible, 0 hidden, 255 unknown at the height it was asked for: for anchors whose range or sector ends. */
  readonly seen: Uint8Array | null;
  readonly antennaAltitudeM: number;
  readonly answer: Summary;
}

export const surfaces = signal<ReadonlyMap<string, Surface>>(new Map());
export const surfaceTimesMs: number[] = [];
const AT_ONCE = 2;
const SETTLE_MS = 150;
const asked = new Set<string>();
const refused = new Map<string, string>();
let settling: ReturnType<typeof setTimeout> | undefined;

function keyOf(on: Dem, anchor: Anchor): string {
  const receiver = isLimited(anchor) ? mission.value.rover.receiver_above_ground_m : null;
  return JSON.stringify([on.id, anchorBody({ ...anchor, ranging_sigma_m: 0 }), receiver]);
}

export function isCurrent(on: Dem, anchor: Anchor): boolean {
  return surfaces.value.get(anchor.id)?.key === keyOf(on, anchor);
}

/** Whether an anchor's surface is still to come. */
export function awaitsSurfaces(): boolean {
  const here = dem.peek();
  return here !== null && mission.peek().anchors.some((one) => !isCurrent(here, one) && !refused.has(keyOf(here, one)));
}

export function watchSurfaces(): void {
  effect(() => {
    const { anchors, rover } = mission.value;
    const here = dem.value;
    if (rover.receiver_above_ground_m < 0 || !here) return;
    forget(here, anchors);
    // a slider of limited anchors waits until it rests; a drag does not wait
    clearTimeout(settling);
    if (anchors.some((one) => isLimited(one) && !isCurrent(here, one))) settling = setTimeout(askNext, SETTLE_MS);
    else askNext();
  });
}

function forget(on: Dem, anchors: readonly Anchor[]): void {
  const ids = new Set(anchors.map((anchor) => anchor.id));
  const stays = [...surfaces.peek()].filter(([id, one]) => ids.has(id) && one.key.includes(on.id));
  if (stays.length !== surfaces.peek().size) surfaces.value = new Map(stays);
  const keys = new Set(anchors.map((anchor) => keyOf(on, anchor)));
  const told = refused.size > 0;
  for (const key of refused.keys()) if (!keys.has(key)) refused.delete(key);
  // what was refused of an anchor is over once no such anchor is left; other refusals stay
  if (told && refused.size === 0) accept("anchors");
}

function askNext(): void {
  const here = dem.peek();
  if (!here) return;
  for (const anchor of mission.peek().anchors) {
    if (asked.size >= AT_ONCE) return;
    if (asked.has(anchor.id) || isCurrent(here, anchor) || refused.has(keyOf(here, anchor))) continue;
    void askFor(here, anchor);
  }
}

async function askFor(on: Dem, anchor: Anchor): Promise<void> {
  const key = keyOf(on, anchor);
  asked.add(anchor.id);
  setBusy("visibility", null);
  const begun = performance.now();
  try {
    const surface = await read(on, anchor, key);
    surfaceTimesMs.push(performance.now() - begun);
    const stillThere = dem.peek()?.id === on.id && mission.peek().anchors.some((one) => one.id === anchor.id);
    if (stillThere) surfaces.value = new Map(surfaces.peek()).set(anchor.id, surface);
  } catch (error) {
    refused.set(key, anchor.id);
    if (dem.peek()?.id === on.id && mission.peek().anchors.some((one) => keyOf(on, one) === key)) refuse("anchors", error);
    const others = new Map(surfaces.peek());
    others.delete(anchor.id);
    surfaces.value = others;
  } finally {
    asked.delete(anchor.id);
    if (asked.size === 0) setBusy("visibility", undefined);
    askNext();
  }
}

function read(on: Dem, anchor: Anchor, key: string): Promise<Surface> {
  const body = {
    dem_id: on.id,
    anchors: [anchorBody(anchor)],
    receiver_above_ground_m: mission.peek().rover.receiver_above_ground_m,
    mode: "fast",
  };
  return passing<VisibilityAnswer, Surface>("/visibility-maps", body, async (job) => {
    const [altitude, seen] = await Promise.all([
      rasterAt(layer(job, "min_visible_altitude.tif")),
      isLimited(anchor) ? rasterAt(layer(job, "visible.tif")) : null,
    ]);
    const found = job.result.anchors[0];
    return {
      key,
      altitudeM: altitude.bands[0] as Float32Array,
      seen: (seen?.bands[0] as Uint8Array | undefined) ?? null,
      antennaAltitudeM: found?.altitude_m ?? NaN,
      answer: job.result,
    };
  });
}
