// How good positioning is on the ground: dilution and position error as arrays; the limit is a slider.
import { effect, signal } from "@preact/signals";
import { layer, passing } from "../api/jobs";
import type { DopAnswer } from "../api/types";
import { rasterAt } from "../geo/rasters";
import { anchorBody } from "../mission/mission";
import { accept, dem, mission, mode, overlay, refuse, setBusy } from "../state";

export interface Dilution {
  readonly key: string;
  /** No unit; +Infinity no fix, NaN unknown. */
  readonly dop: Float32Array;
  /** One sigma in space, metres; +Infinity no fix, NaN unknown; null until somebody looks at it. */
  readonly errorM: Float32Array | null;
  readonly answer: DopAnswer;
}

export const dilution = signal<Dilution | null>(null);
export const dilutionTimesMs: number[] = [];
const SETTLE_MS = 120;
/** With fewer it depends on what is measured whether there is a fix; then the service is asked only on purpose. */
const ENOUGH_FOR_ANY_FIX = 4;
let running = false;
let refusedKey = "";
let settling: ReturnType<typeof setTimeout> | undefined;

interface Wanted {
  readonly key: string;
  readonly body: Record<string, unknown>;
  readonly withError: boolean;
}

/** The question as it stands; null where nobody asks, or nothing can be ranged to. */
function wanted(): Wanted | null {
  const here = dem.value;
  const { anchors, rover, positioning } = mission.value;
  const onMap = overlay.value === "dilution" || overlay.value === "error";
  const looked = onMap || (mode.value === "coverage" && anchors.length >= ENOUGH_FOR_ANY_FIX);
  if (!here || !looked || anchors.length === 0) return null;
  const body = {
    dem_id: here.id,
    anchors: anchors.map(anchorBody),
    receiver_above_ground_m: rover.receiver_above_ground_m,
    kind: positioning.kind,
    measure: positioning.measure,
    on_surface: positioning.on_surface,
    mode: "fast",
  };
  const withError = overlay.value === "error";
  return { key: JSON.stringify([body, withError]), body, withError };
}

export function isDilutionCurrent(): boolean {
  const now = wanted();
  return now !== null && dilution.value?.key === now.key;
}

/** Whether dilution was asked for and is still to come. */
export function awaitsDilution(): boolean {
  const now = wanted();
  return now !== null && dilution.peek()?.key !== now.key && now.key !== refusedKey;
}

export function watchDilution(): void {
  effect(() => {
    const now = wanted();
    if (mission.value.anchors.length === 0) dilution.value = null;
    clearTimeout(settling);
    if (now) settling = setTimeout(() => void askFor(), overlay.peek() === "dilution" ? 0 : SETTLE_MS);
  });
  effect(() => {
    if (dilution.peek() && !dilution.peek()?.key.includes(dem.value?.id ?? " ")) dilution.value = null;
  });
}

async function askFor(): Promise<void> {
  const now = wanted();
  if (running || now === null || now.key === dilution.peek()?.key || now.key === refusedKey) return;
  running = true;
  setBusy("dilution", null);
  const begun = performance.now();
  try {
    const found = await read(now);
    dilutionTimesMs.push(performance.now() - begun);
    accept("coverage");
    if (dem.peek()?.id === now.body["dem_id"]) dilution.value = found;
  } catch (error) {
    refusedKey = now.key;
    refuse("coverage", error);
  } finally {
    running = false;
    setBusy("dilution", undefined);
    void askFor();
  }
}

function read(now: Wanted): Promise<Dilution> {
  return passing<DopAnswer, Dilution>("/dop-maps", now.body, async (job) => {
    const [dop, error] = await Promise.all([
      rasterAt(layer(job, "dop.tif")),
      now.withError ? rasterAt(layer(job, "position_error.tif")) : null,
    ]);
    const errorM = (error?.bands[2] as Float32Array | undefined) ?? null;
    return { key: now.key, dop: dop.bands[0] as Float32Array, errorM, answer: job.result };
  });
}
