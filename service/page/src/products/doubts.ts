// What a watched session knows besides its epochs: the path that it follows, and where its ranges contradict the map.
import { computed, effect, signal } from "@preact/signals";
import { type DetectorLinks, type DoubtFeature, doubtsOf, driveOf } from "../api/detectors";
import type { Place } from "../api/types";
import { frame } from "../state";
import { epoch, epochs, watched } from "./live";

export interface Doubt {
  readonly told: DoubtFeature["properties"];
  /** Where the rover drove meanwhile; one place where it stood. */
  readonly places: readonly Place[];
}

const ASKED_EVERY_MS = 3000;
const found = signal<readonly DoubtFeature[]>([]);
/** The path that the session follows, along which distances of its advice count; none: it follows none. */
export const followed = signal<readonly Place[]>([]);

/** The doubts that had begun at the epoch that is looked at. */
export const doubts = computed<readonly Doubt[]>(() => {
  const now_s = epoch.value?.time_s ?? Infinity;
  return found.value.filter(({ properties }) => properties.from_s <= now_s).map((one) => ({ told: one.properties, places: placesOf(one) }));
});

function placesOf({ geometry }: DoubtFeature): Place[] {
  const pairs = geometry.type === "Point" ? [geometry.coordinates] : geometry.coordinates;
  return pairs.flatMap(([x, y]) => {
    if (x === undefined || y === undefined) return [];
    // of a local frame GeoJSON holds metres, and says so
    return frame.peek()?.toMetres({ lon_deg: x, lat_deg: y }) ?? { east_m: x, north_m: y };
  });
}

/** Ask a session for both; one that is over tells so by its stream. */
export async function readDoubts(links: DetectorLinks): Promise<void> {
  const [features, path] = await Promise.all([doubtsOf(links), driveOf(links)]);
  found.value = features;
  followed.value = (path ?? []).map(([east_m, north_m]) => ({ east_m, north_m }));
}

export function watchDoubts(): void {
  let asked: ReturnType<typeof setTimeout> | null = null;
  let before: DetectorLinks | null = null;
  effect(() => {
    const links = watched.value?.detector?.links;
    if (watched.value === null) [found.value, followed.value] = [[], []];
    if (!links || epochs.value.length === 0 || asked !== null) return;
    asked = setTimeout(
      () => {
        asked = null;
        readDoubts(links).catch(() => undefined); // the session is over, which its stream tells
      },
      links === before ? ASKED_EVERY_MS : 0,
    );
    before = links;
  });
}
