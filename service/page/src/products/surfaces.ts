// What each anchor sees: how high above every kept post it is in sight, asked for by itself and kept, so that only what
// moved is calculated again and the antenna's height is a slider.
import { effect, signal } from "@preact/signals";
import { AGAIN_MS, isPassing } from "../api/http";
import { keptOf, levelsFor, preview } from "../api/previews";
import type { Dem, Summary } from "../api/types";
import type { Ground } from "../geo/grid";
import { isHeard, sightBody, sightKey } from "../mission/hearing";
import { type Anchor, isLimited } from "../mission/mission";
import { accept, dem, following, ground, mission, refuse, setBusy } from "../state";

export interface Surface {
  /** Which anchor on which ground, and whether it is coarse; see keyOf. */
  readonly key: string;
  /** Height above the ground from which on it is in sight (or usable) and reach, millimetres; else NEVER_MM or UNKNOWN_MM. */
  readonly neededMm: Int32Array;
  readonly someUnknown: boolean;
  readonly answer: Summary;
}

export const NEVER_MM = 2_000_000_000;
export const UNKNOWN_MM = NEVER_MM + 1;

export const surfaces = signal<ReadonlyMap<string, Surface>>(new Map());
export const surfaceTimesMs: number[] = [];
const AT_ONCE = 2;
const SETTLE_MS = 150;
const asked = new Set<string>();
const refused = new Map<string, string>();
/** Whether what is told of anchors is that the service could not be asked. */
let unasked = false;
let settling: ReturnType<typeof setTimeout> | undefined;

function keyOf(on: Dem, anchor: Anchor, level: "full" | "coarse" = "full"): string {
  const receiver = isLimited(anchor) ? mission.value.rover.receiver_above_ground_m : null;
  return JSON.stringify([on.id, sightKey(mission.value, [{ ...anchor, ranging_sigma_m: 0 }]), receiver, level]);
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
    const dragged = following.value;
    if (rover.receiver_above_ground_m < 0 || !here) return;
    forget(here, anchors);
    // a slider of limited anchors waits until it rests; a drag does not wait
    clearTimeout(settling);
    const sliding = dragged && anchors.some((one) => isLimited(one) && !isCurrent(here, one));
    if (sliding) settling = setTimeout(askNext, SETTLE_MS);
    else askNext();
  });
}

function forget(on: Dem, anchors: readonly Anchor[]): void {
  const ids = new Set(anchors.map((anchor) => anchor.id));
  const stays = [...surfaces.peek()].filter(([id, one]) => ids.has(id) && one.key.includes(on.id));
  if (stays.length !== surfaces.peek().size) surfaces.value = new Map(stays);
  if (refused.size === 0) return;
  const keys = new Set(anchors.map((anchor) => keyOf(on, anchor)));
  for (const key of refused.keys()) if (!keys.has(key)) refused.delete(key);
  // what was refused of an anchor is over once no such anchor is left; other refusals stay
  if (refused.size === 0) accept("anchors");
}

function askNext(): void {
  const [here, posts] = [dem.peek(), ground.peek()];
  if (!here || !posts || posts.dem.id !== here.id) return;
  const { full, dragged } = levelsFor(here, posts.heights.level, isHeard(mission.peek()));
  const level = following.peek() ? dragged : full;
  for (const anchor of mission.peek().anchors) {
    if (asked.size >= AT_ONCE) return;
    if (asked.has(anchor.id) || isCurrent(here, anchor) || refused.has(keyOf(here, anchor))) continue;
    const coarse = level > full;
    if (coarse && surfaces.peek().get(anchor.id)?.key === keyOf(here, anchor, "coarse")) continue;
    void askFor(posts, anchor, level, coarse);
  }
}

async function askFor(on: Ground, anchor: Anchor, level: number, coarse: boolean): Promise<void> {
  const full = keyOf(on.dem, anchor);
  const key = coarse ? keyOf(on.dem, anchor, "coarse") : full;
  const stands = (): boolean => dem.peek()?.id === on.dem.id && mission.peek().anchors.some((one) => one.id === anchor.id);
  asked.add(anchor.id);
  setBusy("visibility", null);
  const begun = performance.now();
  try {
    const surface = await read(on, anchor, level, key);
    surfaceTimesMs.push(performance.now() - begun);
    if (stands()) surfaces.value = new Map(surfaces.peek()).set(anchor.id, surface);
    if (unasked) accept("anchors");
    unasked = false;
  } catch (error) {
    const passing = isPassing(error);
    if (!passing) refused.set(full, anchor.id);
    if (stands() && mission.peek().anchors.some((one) => keyOf(on.dem, one) === full)) refuse("anchors", error);
    const others = new Map(surfaces.peek());
    others.delete(anchor.id);
    surfaces.value = others;
    unasked = passing;
    if (passing) await new Promise((resume) => setTimeout(resume, AGAIN_MS));
  } finally {
    asked.delete(anchor.id);
    if (asked.size === 0) setBusy("visibility", undefined);
    askNext();
  }
}

async function read(on: Ground, anchor: Anchor, level: number, key: string): Promise<Surface> {
  const found = await preview({
    dem_id: on.dem.id,
    ...sightBody(mission.peek(), { anchors: [anchor] }),
    receiver_above_ground_m: mission.peek().rover.receiver_above_ground_m,
    level,
    show: "needed_height",
  });
  const { rows, cols } = on.heights;
  const neededM = keptOf(found, 0, level - on.heights.level, rows, cols);
  const neededMm = new Int32Array(neededM.length);
  let someUnknown = false;
  for (let at = 0; at < neededM.length; at += 1) {
    const metres = neededM[at] as number;
    const known = !Number.isNaN(metres);
    someUnknown ||= !known;
    neededMm[at] = known ? Math.max(-NEVER_MM / 2, Math.min(NEVER_MM, Math.ceil(metres * 1000))) : UNKNOWN_MM;
  }
  return { key, neededMm, someUnknown, answer: found };
}
