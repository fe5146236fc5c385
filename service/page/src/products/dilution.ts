// How good positioning is on the ground: dilution and position error as arrays; the limit is a slider.
import { effect, signal } from "@preact/signals";
import { keptOf, levelsFor, preview } from "../api/previews";
import type { Summary } from "../api/types";
import type { Ground } from "../geo/grid";
import { countedPosts } from "../geo/sample";
import { isHeard, sightBody, sightKey } from "../mission/hearing";
import type { Positioning } from "../mission/mission";
import { dem, following, ground, mission, mode, overlay } from "../state";
import { asking } from "./asking";

export interface DilutionTold extends Summary {
  readonly measure: Positioning["measure"];
  readonly on_surface: boolean;
  /** Part of the known posts whose dilution is unknown, 0..1; null where no post is known. */
  readonly share_unknown: number | null;
  /** p50 and p95 of what is known; +Infinity is no fix. */
  readonly dop_quantiles: Readonly<Record<"p50" | "p95", number>>;
}

export interface Dilution {
  readonly key: string;
  /** No unit; +Infinity no fix, NaN unknown. */
  readonly dop: Float32Array;
  /** One sigma in space, metres; +Infinity no fix, NaN unknown; null until somebody looks at it. */
  readonly errorM: Float32Array | null;
  readonly answer: DilutionTold;
}

export const dilution = signal<Dilution | null>(null);

interface Wanted {
  readonly key: string;
  readonly on: Ground;
  readonly coarser: number;
  readonly asked: Pick<Positioning, "kind" | "measure" | "on_surface">;
  readonly body: Readonly<Record<string, unknown>>;
  readonly withError: boolean;
}

const isShown = (): boolean => overlay.value === "dilution" || overlay.value === "error";

/** The question as it stands; null where nobody asks, or nothing can be ranged to. */
function wanted(): Wanted | null {
  const [here, on, now] = [dem.value, ground.value, mission.value];
  const { anchors, rover, positioning } = now;
  // a slider over another map asks nothing; the numbers beside it follow when it rests
  const looked = isShown() || (mode.value === "coverage" && !following.value);
  if (!here || !on || !looked || anchors.length === 0) return null;
  const { full, dragged } = levelsFor(here, on.heights.level, isHeard(now));
  const level = following.value ? dragged : full;
  const { kind, measure, on_surface } = positioning;
  const body = { dem_id: here.id, receiver_above_ground_m: rover.receiver_above_ground_m, kind, measure, on_surface, level };
  const withError = overlay.value === "error";
  const key = JSON.stringify([body, sightKey(now), withError]);
  return { key, on, coarser: level - on.heights.level, asked: { kind, measure, on_surface }, body: { ...body, ...sightBody(now) }, withError };
}

const questions = asking({ work: "dilution", answer: dilution, wanted, isShown, read });
export const [isDilutionCurrent, awaitsDilution, dilutionTimesMs] = [questions.isCurrent, questions.awaits, questions.timesMs];

export function watchDilution(): void {
  effect(() => {
    if (mission.value.anchors.length === 0) dilution.value = null;
  });
  questions.watch();
}

async function read({ key, on, coarser, body, asked, withError }: Wanted): Promise<Dilution> {
  const [told, error] = await Promise.all([preview({ ...body, show: "dop" }), withError ? preview({ ...body, show: "position_error" }) : null]);
  const { rows, cols } = on.heights;
  const dop = keptOf(told, 0, coarser, rows, cols);
  return { key, dop, errorM: error && keptOf(error, 0, coarser, rows, cols), answer: { ...told, ...asked, ...factsOf(on, dop) } };
}

/** What the service's dilution map tells in numbers, of the posts that shares are counted over. */
function factsOf(on: Ground, dop: Float32Array): Pick<DilutionTold, "share_unknown" | "dop_quantiles"> {
  const sample = countedPosts(on);
  const [lights, here] = [sample.of(on.shade), sample.of(dop)];
  const known = here.filter((value, at) => lights[at] !== 0 && !Number.isNaN(value)).sort();
  const posts = lights.reduce((sum, light) => sum + (light === 0 ? 0 : 1), 0);
  const quantile = (share: number): number => known[Math.max(0, Math.ceil(share * known.length) - 1)] ?? Infinity;
  return { share_unknown: posts === 0 ? null : 1 - known.length / posts, dop_quantiles: { p50: quantile(0.5), p95: quantile(0.95) } };
}

/** Share of the known posts, among them those that are known to have no fix, whose dilution lies below a limit. */
export function shareBelow(on: Ground, dop: Float32Array, limit: number): number {
  const here = countedPosts(on).of(dop);
  let [known, below] = [0, 0];
  for (let at = 0; at < here.length; at += 1) {
    const value = here[at] as number;
    if (Number.isNaN(value)) continue;
    known += 1;
    if (value < limit) below += 1;
  }
  return below / Math.max(known, 1);
}
