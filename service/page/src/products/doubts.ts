// What a watched session knows besides its epochs: the path that it follows, and where its ranges contradict the map.
import { computed, effect, signal } from "@preact/signals";
import { type DetectorLinks, type DoubtFeature, type DoubtFile, doubtsOf, driveOf } from "../api/detectors";
import type { Place } from "../api/types";
import { frame, refuse } from "../state";
import { epoch, epochs, openLinks, watched } from "./live";
import { paced } from "./paced";

export interface Doubt {
  readonly told: DoubtFeature["properties"];
  /** Where the rover drove meanwhile; one place where it stood. */
  readonly places: readonly Place[];
}

const REST_MS = 3000;
/** The file of the doubts as the session wrote it last. */
export const doubtFile = signal<DoubtFile | null>(null);
/** The path that the session follows, along which distances of its advice count; none: it follows none. */
export const followed = signal<readonly Place[]>([]);

/** The doubts that had begun at the epoch that is looked at. */
export const doubts = computed<readonly Doubt[]>(() => {
  const now_s = epoch.value?.time_s ?? Infinity;
  return (doubtFile.value?.features ?? []).filter(({ properties }) => properties.from_s <= now_s).map((one) => ({ told: one.properties, places: placesOf(one) }));
});

function placesOf({ geometry }: DoubtFeature): Place[] {
  const pairs = geometry.type === "Point" ? [geometry.coordinates] : geometry.coordinates;
  return pairs.flatMap(([x, y]) => {
    if (x === undefined || y === undefined) return [];
    // of a local frame GeoJSON holds metres, and says so
    return frame.peek()?.toMetres({ lon_deg: x, lat_deg: y }) ?? { east_m: x, north_m: y };
  });
}

/** Ask a session for both, one after the other, as long as anybody wants to know. */
export async function readDoubts(links: DetectorLinks, isWanted = () => true): Promise<void> {
  const file = await doubtsOf(links);
  if (!isWanted()) return;
  const path = await driveOf(links);
  if (!isWanted()) return;
  doubtFile.value = file;
  followed.value = (path ?? []).map(([east_m, north_m]) => ({ east_m, north_m }));
}

/** What an open session knows by now; none is asked that is over or that nobody watches any more. */
async function readOpen(): Promise<void> {
  const links = openLinks.peek();
  if (links === null) return;
  const isWanted = () => openLinks.peek() === links;
  try {
    await readDoubts(links, isWanted);
  } catch (error) {
    if (isWanted()) refuse("live", error);
  }
}

export function watchDoubts(): void {
  const read = paced(readOpen, REST_MS);
  effect(() => {
    if (watched.value === null) [doubtFile.value, followed.value] = [null, []];
    if (openLinks.value !== null && epochs.value.length > 0) read();
  });
}
