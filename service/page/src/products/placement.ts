// "Find N more": the placement's answer as ghosts, which are taken one by one.
import { signal } from "@preact/signals";
import { ask } from "../api/http";
import { calculate } from "../api/jobs";
import type { Place, PlacedAnchor, PlacementAnswer } from "../api/types";
import type { Ground } from "../geo/grid";
import { bytesOf } from "../geo/rasters";
import { isHeard, sightBody } from "../mission/hearing";
import { type Anchor, type Mission, newAnchor, nextId, type Placing, type Positioning, type Ring, type Rules } from "../mission/mission";
import { change, ground, mission, overlay } from "../state";
import { words } from "../words";
import { fixNeeds } from "./dark";
import { pathLine } from "./path";
import { working } from "./working";

export const ghosts = signal<readonly PlacedAnchor[]>([]);
/** What was found; proposed: by a map of sites, not on a lattice, lay the places that were tried. */
export const placement = signal<(PlacementAnswer & { readonly proposed: boolean }) | null>(null);
/** How many anchors are in sight of, or usable at, each kept post with all that was found, of so many; 255 where there is no ground. */
export const after = signal<{ readonly of: number; readonly count: Uint8Array; readonly heard: boolean } | null>(null);
/** Of a lattice: some hundred places, and some dozen where every place takes a map of its signal. */
const PLACES_ACROSS = 28;
const HEARD_ACROSS = 9;
/** What the service takes as enough for coverage where nobody says. */
const USUAL_COVERAGE = 4;

/** A lattice over where the mission is, unless the planner says how wide. */
export function spacingOf(here: Ground, now: Pick<Mission, "anchors" | "area" | "placing" | "positioning">): number {
  const { area, placing } = now;
  if (placing.spacing_m !== null) return placing.spacing_m;
  const span = (metres: readonly number[]): number => Math.max(...metres) - Math.min(...metres);
  const { west, east, south, north } = here.extent;
  const across = area ? Math.max(span(area.map(({ east_m }) => east_m)), span(area.map(({ north_m }) => north_m))) : Math.max(east - west, north - south);
  return across / (isHeard(now) ? HEARD_ACROSS : PLACES_ACROSS);
}

type Goal = Pick<Placing, "objective" | "min_anchors">;

/** Whether a rover that moves along the surface only is placed for. */
const isAlong = ({ objective }: Goal, { on_surface }: Positioning): boolean => objective === "mean_error" || on_surface;

/** How many anchors are enough where the planner does not say: what the service takes then. */
export function enoughOf(goal: Goal, positioning: Positioning): number {
  if (goal.min_anchors !== null) return goal.min_anchors;
  return goal.objective === "coverage" ? USUAL_COVERAGE : fixNeeds({ ...positioning, on_surface: isAlong(goal, positioning) });
}

/** What is good, as questions say it; along the surface there is one dilution, which has no measure. */
export function goalBody(positioning: Positioning, goal: Goal): Record<string, unknown> {
  const { kind, measure, dop_limit } = positioning;
  const { objective, min_anchors } = goal;
  const least = min_anchors === null ? {} : { min_anchors };
  return { objective, ...least, kind, dop_limit, ...(isAlong(goal, positioning) ? { on_surface: true } : { measure }) };
}

/** So many more anchors than a mission has, for these targets; of usable signals they have the radio of the last. */
export function placementBody(here: Ground, now: Mission, count: number, targets: Record<string, unknown>, goal: Goal): Record<string, unknown> {
  const { anchors, area, placing, positioning, rover, route, rules } = now;
  const radio = isHeard(now) ? { radio: anchors.at(-1)?.radio } : {};
  const tried = placing.best_sites === null ? { spacing_m: spacingOf(here, now) } : { best_sites: placing.best_sites };
  const places = { ...tried, above_ground_m: [placing.above_ground_m] };
  return {
    dem_id: here.dem.id,
    ...sightBody(now),
    ...radio,
    count,
    candidates: [{ ...places, ...(area ? { area: { ring: area } } : {}) }],
    targets: { receiver_above_ground_m: rover.receiver_above_ground_m, ...targets },
    goal: goalBody(positioning, goal),
    rules: rulesBody(rules, route.no_go),
    mode: "fast",
    time_limit_s: 30,
  };
}

export async function findMore(): Promise<void> {
  const here = ground.peek();
  const { anchors, area, placing } = mission.peek();
  if (!here) throw new Error(words.chooseGround);
  const ring = area ? { area: { ring: area } } : {};
  const along = pathLine.peek();
  if (placing.where === "path" && along.length < 2) throw new Error(words.noPathYet);
  const path = thinned(along).map(({ east_m, north_m }) => ({ east_m, north_m }));
  const { objective, min_anchors } = placing;
  const body = placementBody(here, mission.peek(), placing.count, placing.where === "path" ? { path } : ring, { objective, min_anchors });
  await working("placement", async (following) => {
    const job = await calculate<PlacementAnswer>("/placements", body, following);
    const placed = job.result.placed.map((one, number) => ({ ...one, id: `P${number + 1}` }));
    const [, count] = await bytesOf(job, "count.tif", here);
    after.value = { of: anchors.length + placed.length, count: count as Uint8Array, heard: "radio" in body };
    placement.value = { ...job.result, placed, proposed: placing.best_sites !== null };
    ghosts.value = placed;
    void ask(job.links.self, { method: "DELETE" });
  });
}

/** The rules as drawn; where the rover must not go, no anchor is put either. */
export function rulesBody(rules: Rules, noGo: readonly Ring[]): Record<string, unknown> {
  const { no_fly, stand_off, max_above_ground_m, max_altitude_m, max_range_m, min_separation_m } = rules;
  const limits = Object.entries({ max_above_ground_m, max_altitude_m, max_range_m }).filter(([, limit]) => limit !== null);
  return { no_fly: [...noGo, ...no_fly].map((ring) => ({ ring })), stand_off, min_separation_m, ...Object.fromEntries(limits) };
}

/** At most some hundred points of a path, its ends included. */
export function thinned<T>(all: readonly T[]): T[] {
  const step = Math.max(1, Math.ceil(all.length / 300));
  return all.filter((_, number) => number % step === 0 || number === all.length - 1);
}

/** Anchors with one more where one was found. */
export function withPlaced(anchors: readonly Anchor[], { east_m, north_m }: Place, aboveGroundM: number): readonly Anchor[] {
  const anchor = { ...newAnchor(anchors, { east_m, north_m }), id: nextId(anchors), height_m: aboveGroundM };
  return [...anchors, { ...anchor, height_from: "above_ground_m", kind: "drone" }];
}

export function acceptGhost(id: string): void {
  const ghost = ghosts.peek().find((one) => one.id === id);
  if (!ghost) return;
  const { anchors, placing } = mission.peek();
  change({ anchors: withPlaced(anchors, ghost, placing.above_ground_m) });
  ghosts.value = ghosts.peek().filter((one) => one.id !== id);
}

export function dismissGhosts(): void {
  ghosts.value = [];
  [placement.value, after.value] = [null, null];
  if (overlay.peek() === "after") overlay.value = "count";
}
