// What lies ahead of a rover on its planned path: where too few anchors will be usable, and what would help.
import { computed, effect, signal } from "@preact/signals";
import { type Advice, adviceOf } from "../api/detectors";
import type { Place } from "../api/types";
import { refuse } from "../state";
import { followed } from "./doubts";
import { epochs, lookedAt, openLinks, watched } from "./live";
import { paced } from "./paced";

/** The last advice up to the epoch that is looked at. */
export const advice = computed<Advice | null>(() => {
  const last = lookedAt.value ?? epochs.value.length - 1;
  for (let at = last; at >= 0; at -= 1) {
    const told = epochs.value[at]?.advice;
    if (told) return told;
  }
  return null;
});

/** The sentence about the drone that would help at the first stretch ahead; asked for when that is another one. */
export const move = signal<string | null>(null);
let stretch = "";

async function readMove(): Promise<void> {
  const [links, of] = [openLinks.peek(), stretch];
  if (links === null || of === "") return;
  const isWanted = () => openLinks.peek() === links && stretch === of;
  try {
    const told = await adviceOf(links);
    if (isWanted()) move.value = told.move?.sentence ?? null;
  } catch (error) {
    if (isWanted()) refuse("live", error);
  }
}

export function watchAhead(): void {
  const read = paced(readMove, 0);
  effect(() => {
    const id = watched.value?.detector?.id;
    const [first] = advice.value?.stretches ?? [];
    const now = id && first ? `${id} ${first.to_m.toFixed(0)} ${first.hidden.join(" ")}` : "";
    if (now === stretch) return;
    [move.value, stretch] = [null, now];
    if (now !== "" && openLinks.peek() !== null) read();
  });
}

/** The stretches ahead as lines on the map. */
export const darkAhead = computed<readonly (readonly Place[])[]>(() => (advice.value?.stretches ?? []).map(({ from_m, to_m }) => between(followed.value, from_m, to_m)).filter((line) => line.length > 1));

/** Where the path leads through what no rover is on, as lines on the map. */
export const obstructedAhead = computed<readonly (readonly Place[])[]>(() => (advice.value?.obstructed ?? []).map(({ from_m, to_m }) => between(followed.value, from_m, to_m)).filter((line) => line.length > 1));

/** The part of a line between two distances along it, metres. */
export function between(line: readonly Place[], fromM: number, toM: number): Place[] {
  const part: Place[] = [];
  let along = 0;
  for (let at = 1; at < line.length; at += 1) {
    const [from, to] = [line[at - 1] as Place, line[at] as Place];
    const metres = Math.hypot(to.east_m - from.east_m, to.north_m - from.north_m);
    const placeAt = (distance: number): Place => {
      const share = metres === 0 ? 0 : (distance - along) / metres;
      return { east_m: from.east_m + share * (to.east_m - from.east_m), north_m: from.north_m + share * (to.north_m - from.north_m) };
    };
    if (along + metres > fromM && along < toM) {
      if (part.length === 0) part.push(placeAt(Math.max(fromM, along)));
      part.push(placeAt(Math.min(toM, along + metres)));
    }
    along += metres;
  }
  return part;
}
