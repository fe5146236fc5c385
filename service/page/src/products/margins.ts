// What of the best anchor's signal is beyond the receiver's need, over every kept post; the margin wanted is a slider.
import { effect, signal } from "@preact/signals";
import { keptOf, levelsFor, preview } from "../api/previews";
import type { Summary } from "../api/types";
import type { Ground } from "../geo/grid";
import { isHeard, sightBody, sightKey } from "../mission/hearing";
import { dem, following, ground, mission, overlay } from "../state";
import { asking } from "./asking";

export interface Margins {
  readonly key: string;
  /** Of the anchor that is heard best, dB; -Infinity nothing arrives, NaN unknown. */
  readonly bestDb: Float32Array;
  readonly answer: Summary;
}

export const margins = signal<Margins | null>(null);
/** Margin that is wanted beyond the receiver's need, dB. */
export const marginWantedDb = signal(0);

interface Wanted {
  readonly key: string;
  readonly on: Ground;
  readonly coarser: number;
  readonly body: Readonly<Record<string, unknown>>;
}

const isShown = (): boolean => overlay.value === "signal";

function wanted(): Wanted | null {
  const [here, on, now] = [dem.value, ground.value, mission.value];
  if (!here || !on || !isShown() || !isHeard(now)) return null;
  const { full, dragged } = levelsFor(here, on.heights.level, true);
  const level = following.value ? dragged : full;
  const body = { dem_id: here.id, receiver_above_ground_m: now.rover.receiver_above_ground_m, level, show: "margin_db" };
  return { key: JSON.stringify([body, sightKey(now)]), on, coarser: level - on.heights.level, body: { ...body, ...sightBody(now) } };
}

async function read({ key, on, coarser, body }: Wanted): Promise<Margins> {
  const answer = await preview(body);
  const { rows, cols } = on.heights;
  const all = answer.arrays.map((_, number) => keptOf(answer, number, coarser, rows, cols));
  return { key, bestDb: bestOf(all), answer };
}

/** The highest of each place; one that is not known counts where no other is heard well enough to be usable. */
export function bestOf(all: readonly Float32Array[]): Float32Array {
  const best = new Float32Array(all[0]?.length ?? 0).fill(-Infinity);
  const isUnknown = new Uint8Array(best.length);
  for (const one of all) {
    for (let at = 0; at < best.length; at += 1) {
      const here = one[at] as number;
      if (Number.isNaN(here)) isUnknown[at] = 1;
      else if (here > (best[at] as number)) best[at] = here;
    }
  }
  for (let at = 0; at < best.length; at += 1) if (isUnknown[at] === 1 && (best[at] as number) < 0) best[at] = NaN;
  return best;
}

const asked = asking({ work: "signals", answer: margins, wanted, isShown, read });
export const awaitsMargins = asked.awaits;

export function watchMargins(): void {
  effect(() => {
    if (overlay.value === "signal" && !isHeard(mission.value)) overlay.value = "count";
  });
  asked.watch();
}
