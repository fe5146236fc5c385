// One place asked about by itself: clearances of exact lines, dilution and error, some milliseconds after the pointer
// has come to rest; the arrays answer before that.
import { effect, signal } from "@preact/signals";
import { askJson, posted } from "../api/http";
import type { Place, ProbeAnswer } from "../api/types";
import { isHeard } from "../mission/hearing";
import { coverBody, heardBody } from "../mission/mission";
import { cursor, dem, mission, pinned } from "../state";

export interface Probed {
  readonly place: Place;
  readonly answer: ProbeAnswer["points"][number];
}

export const probed = signal<Probed | null>(null);
export const probeTimesMs: number[] = [];
const REST_MS = 30;
const WAIT_S = 5;
let resting: ReturnType<typeof setTimeout> | undefined;
let asking: AbortController | null = null;

export function watchProbes(): void {
  effect(() => {
    const place = pinned.value ?? cursor.value;
    const here = dem.value;
    const now = mission.value;
    const { anchors, buildings, trees, rover, positioning } = now;
    probed.value = null;
    clearTimeout(resting);
    asking?.abort();
    if (!place || !here || anchors.length === 0) return;
    const body = {
      dem_id: here.id,
      ...coverBody(buildings, trees),
      points: [{ east_m: place.east_m, north_m: place.north_m }],
      anchors: anchors.map(heardBody),
      sight: isHeard(now) ? "usable" : "visible",
      receiver_above_ground_m: rover.receiver_above_ground_m,
      kind: positioning.kind,
      on_surface: positioning.on_surface,
    };
    resting = setTimeout(() => void probe(place, body), REST_MS);
  });
}

async function probe(place: Place, body: unknown): Promise<void> {
  const mine = new AbortController();
  asking = mine;
  const begun = performance.now();
  try {
    const { points } = await askJson<ProbeAnswer>("/probe", posted(body, WAIT_S, mine.signal));
    const [answer] = points;
    if (mine.signal.aborted || !answer) return;
    probeTimesMs.push(performance.now() - begun);
    probed.value = { place, answer };
  } catch (error) {
    // an anchor that cannot stand where it is has been refused where it was put already
    if (!mine.signal.aborted) console.warn("The place could not be probed:", error);
  }
}
