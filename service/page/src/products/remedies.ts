// What would open a blocked path besides a limit that is relaxed: one anchor moved, or added. Each is tried before it is told.
import { signal } from "@preact/signals";
import { ask, askText, Refusal } from "../api/http";
import { calculate, type Following, layer } from "../api/jobs";
import type { PathAnswer, Place, PlacementAnswer, RepositioningAnswer } from "../api/types";
import type { Ground } from "../geo/grid";
import { sightBody } from "../mission/hearing";
import type { Anchor, Mission } from "../mission/mission";
import { tableOf } from "../mission/tables";
import { change, ground, mission, notice } from "../state";
import { distance } from "../units";
import { words } from "../words";
import { fixNeeds } from "./dark";
import { flies } from "./frames";
import { isAsked, pathQuestion, planned, planPath } from "./path";
import { goalBody, placementBody, rulesBody, thinned, withPlaced } from "./placement";
import { stop, working } from "./working";

export interface Remedy {
  readonly sentence: string;
  readonly take: () => void;
}

/** Those that open the path of the question; null where none were sought. */
export const remedies = signal<{ readonly of: string; readonly all: readonly Remedy[] } | null>(null);
const OF_ANCHORS: ReadonlySet<string> = new Set(["anchors in sight", "dilution", "safety bubble", "exact sight lines"]);
/** Kinds of refusals: the start, the goal or a way-point cannot be there, or no place can. */
const OF_PLACES = /\/(place|no-coverage)$/;
const MOST_ADDED = 2;

export function areRemediesCurrent(): boolean {
  return isAsked(remedies.value?.of);
}

/** Ask, and leave nothing behind. */
async function asked<R, T>(path: string, body: unknown, { signal }: Following, read: (job: Awaited<ReturnType<typeof calculate<R>>>) => T | Promise<T>): Promise<T> {
  const job = await calculate<R>(path, body, signal ? { signal } : {});
  try {
    return await read(job);
  } finally {
    await ask(job.links.self, { method: "DELETE" });
  }
}

/** Plan the path; where anchors are what blocks it, or forbids its ends, try what else would open it. */
export async function planAndHelp(): Promise<void> {
  remedies.value = null;
  stop("remedies"); // those of the path before
  try {
    await planPath();
  } catch (error) {
    if (error instanceof Refusal && OF_PLACES.test(error.type)) void seekRemedies();
    throw error;
  }
  const reason = planned.peek()?.answer.unreachable?.reason;
  if (reason !== undefined && OF_ANCHORS.has(reason)) await seekRemedies();
}

async function seekRemedies(): Promise<void> {
  const [here, now] = [ground.peek(), mission.peek()];
  const { route } = now;
  if (!here || (route.min_anchors === 0 && !route.keep_dop && route.bubble_epsilon === 0)) return;
  try {
    await working("remedies", async (following) => {
      const way = await wayWithout(now, following);
      const found: Remedy[] = [];
      for (const sought of way.length < 2 ? [] : [movedAnchors, addedAnchors]) {
        const remedy = await sought(here, now, way, following);
        if (remedy) found.push(remedy);
      }
      remedies.value = { of: JSON.stringify(pathQuestion(now)), all: found };
    });
  } catch (error) {
    if (error instanceof Refusal && error.type === "cancelled") return;
    // the answer to what was asked stands; this was more
    notice.value = words.noRemedy(error instanceof Error ? error.message : String(error));
  }
}

/** The same without other ways, which open nothing. */
const alone = ({ route, ...now }: Mission): Mission => ({ ...now, route: { ...route, alternatives: 0 } });

/** The way that the ground allows, whatever anchors are in sight. */
function wayWithout(now: Mission, following: Following): Promise<readonly Place[]> {
  const { limits, ...body } = pathQuestion(alone(now));
  const { kind, measure, on_surface } = limits;
  return asked<PathAnswer, readonly Place[]>("/paths", { ...body, limits: { kind, measure, on_surface } }, following, async (job) => {
    if (job.result.status !== "found") return [];
    const rows = tableOf(await askText(layer(job, "path.csv")));
    return thinned(rows.map((row) => ({ east_m: Number(row["east_m"]), north_m: Number(row["north_m"]) })));
  });
}

/** How long the path is with these anchors, metres; null where there is none. */
function lengthWith(now: Mission, anchors: readonly Anchor[], following: Following): Promise<number | null> {
  return asked<PathAnswer, number | null>("/paths", pathQuestion(alone({ ...now, anchors })), following, ({ result }) => (result.status === "found" ? (result.totals?.length_m ?? null) : null));
}

function goalOf({ route, positioning }: Mission) {
  return { objective: route.keep_dop ? "dop" : "coverage", min_anchors: Math.max(route.min_anchors, route.keep_dop ? fixNeeds(positioning) : 1) } as const;
}

async function addedAnchors(here: Ground, now: Mission, path: readonly Place[], following: Following): Promise<Remedy | null> {
  const { above_ground_m } = now.placing;
  for (let count = 1; count <= MOST_ADDED; count += 1) {
    const body = placementBody(here, now, count, { path }, goalOf(now));
    const placed = await asked<PlacementAnswer, readonly Place[]>("/placements", body, following, ({ result }) => result.placed);
    let anchors = now.anchors;
    for (const place of placed) anchors = withPlaced(anchors, place, above_ground_m);
    const length = placed.length === 0 ? null : await lengthWith(now, anchors, following);
    if (length === null) continue;
    const added = anchors.slice(now.anchors.length);
    return { sentence: words.addsAnchors(added.map(({ id }) => id), added.map(told), distance(length)), take: () => change({ anchors }) };
  }
  return null;
}

async function movedAnchors(here: Ground, now: Mission, path: readonly Place[], following: Following): Promise<Remedy | null> {
  const movable = now.anchors.filter((one) => one.kind === "drone" && !flies(one)).map(({ id }) => id);
  if (movable.length === 0) return null;
  const body = {
    dem_id: here.dem.id,
    ...sightBody(now),
    movable,
    path,
    receiver_above_ground_m: now.rover.receiver_above_ground_m,
    goal: goalBody(now.positioning, goalOf(now)),
    rules: rulesBody(now.rules, now.route.no_go),
    mode: "fast",
  };
  const moves = await asked<RepositioningAnswer, RepositioningAnswer["moves"]>("/repositionings", body, following, ({ result }) => result.moves);
  if (moves.length === 0) return null;
  const anchors = now.anchors.map((anchor) => {
    const to = moves.find(({ anchor_id }) => anchor_id === anchor.id)?.to;
    if (!to) return anchor;
    const height = to.above_ground_m === null ? ({ height_from: "altitude_m", height_m: to.altitude_m } as const) : ({ height_from: "above_ground_m", height_m: Math.round(to.above_ground_m) } as const);
    return { ...anchor, east_m: to.east_m, north_m: to.north_m, ...height };
  });
  const length = await lengthWith(now, anchors, following);
  if (length === null) return null;
  const gone = anchors.filter((anchor, at) => anchor !== now.anchors[at]);
  return { sentence: words.movesAnchors(gone.map(({ id }) => id), gone.map(told), distance(length)), take: () => change({ anchors }) };
}

function told({ east_m, north_m }: Place): string {
  return `E ${east_m.toFixed(0)} N ${north_m.toFixed(0)}`;
}
