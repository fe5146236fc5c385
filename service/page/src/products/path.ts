// The path of the rover: asked for, drawn in strips, and where it is blocked.
import { effect, signal } from "@preact/signals";
import { askText } from "../api/http";
import { calculate, layer } from "../api/jobs";
import type { LayerLink, PathAnswer, Place, Relaxation } from "../api/types";
import { css, limitSteps, SLOPE_STEPS, countColour, stepColour } from "../map/palettes";
import { isHeard, sightBody } from "../mission/hearing";
import type { Mission, Positioning, Ring } from "../mission/mission";
import { change, ground, mission } from "../state";
import { words } from "../words";
import { tableOf } from "../mission/tables";
import { flies, tracksBody } from "./frames";
import { working } from "./working";

export interface Vertex extends Place {
  readonly distance_m: number;
  readonly time_s: number;
  readonly altitude_m: number;
  readonly slope_deg: number;
  readonly anchor_count: number;
  readonly dop: number;
  readonly sigma_m: number;
  readonly bubble_m: number;
}

export const STRIPS = ["plain", "slope", "sight", "dilution", "error", "bubble"] as const;
export type Strip = (typeof STRIPS)[number];

export interface PlannedPath {
  readonly key: string;
  /** Whether it is of usable signals, not of what is in sight. */
  readonly heard: boolean;
  readonly answer: PathAnswer;
  readonly vertices: readonly Vertex[];
  readonly downloads: readonly LayerLink[];
}

const SECONDS = 40;
/** Of five plans, one for each time to leave. */
const SECONDS_OF_WINDOW = 150;

export const planned = signal<PlannedPath | null>(null);
export const stripShown = signal<Strip>("dilution");
export const pathLine = signal<readonly Vertex[]>([]);
export const blockedAt = signal<Place | null>(null);
export const markedVertex = signal<Vertex | null>(null);

const polygon = (ring: Ring): { ring: Ring } => ({ ring });

interface PathLimits {
  readonly min_anchors: number;
  readonly kind: Positioning["kind"];
  readonly measure: Positioning["measure"];
  readonly on_surface: boolean;
  readonly bubble_epsilon: number;
  readonly dop_limit?: number;
}

/** When it leaves, where that makes a difference: the window in which it may, and by when it has to be there. */
function windowBody({ departure_s, leave_by_s, arrive_by_s }: Mission["route"]): Record<string, unknown> {
  if (leave_by_s === null) return { departure_s };
  return { departure_s, leave_by_s, ...(arrive_by_s === null ? {} : { arrive_by_s }) };
}

/** What the service is asked about a mission's path; anchors that fly count where they are when the rover comes. */
export function pathQuestion(now: Mission): Record<string, unknown> & { readonly limits: PathLimits } {
  const { route, rover, positioning } = now;
  if (!ground.value) throw new Error(words.chooseGround);
  if (!route.start) throw new Error(words.noStart);
  if (!route.goal) throw new Error(words.noGoal);
  const limits = {
    min_anchors: route.min_anchors,
    kind: positioning.kind,
    measure: positioning.measure,
    on_surface: positioning.on_surface,
    bubble_epsilon: route.bubble_epsilon,
    ...(route.keep_dop ? { dop_limit: positioning.dop_limit } : {}),
  };
  const moves = now.anchors.some(flies);
  return {
    dem_id: ground.value.dem.id,
    ...sightBody(now, { anchors: now.anchors.filter((one) => !flies(one)), heard: isHeard(now) }),
    ...(moves ? { tracks: tracksBody(now.anchors, ground.value.dem.cell_east_m, isHeard(now)), ...windowBody(route) } : {}),
    ...(route.alternatives > 0 ? { alternatives: route.alternatives } : {}),
    start: route.start,
    goals: [route.goal],
    way_points: route.way_points,
    no_go: route.no_go.map(polygon),
    keep_in: route.keep_in.map(polygon),
    rover,
    limits,
    mode: "fast",
    budget: { seconds: moves && route.leave_by_s !== null ? SECONDS_OF_WINDOW : SECONDS, sampling: false },
  };
}

/** Whether the path of a mission as it stands is what was asked about. */
export function isAsked(key: string | undefined): boolean {
  try {
    return key !== undefined && key === JSON.stringify(pathQuestion(mission.value));
  } catch {
    return false; // start or goal were taken away since
  }
}

export function isPathCurrent(): boolean {
  return isAsked(planned.value?.key);
}

export async function planPath(): Promise<void> {
  const body = pathQuestion(mission.value);
  const heard = isHeard(mission.value);
  await working("path", async (following) => {
    const job = await calculate<PathAnswer>("/paths", body, following);
    const found = job.result.status === "found";
    const rows = found ? tableOf(await askText(layer(job, "path.csv"))) : [];
    const vertices = rows.map(vertexOf);
    planned.value = { key: JSON.stringify(body), heard, answer: job.result, vertices, downloads: job.layers };
    pathLine.value = vertices;
    blockedAt.value = job.result.unreachable?.where ?? null;
  });
}

export function forgetPath(): void {
  planned.value = null;
  pathLine.value = [];
  blockedAt.value = null;
}

export function watchPath(): void {
  effect(() => {
    const { route } = mission.value;
    if (!route.start || !route.goal) forgetPath();
  });
}

function vertexOf(row: Readonly<Record<string, string>>): Vertex {
  const number = (name: string): number => {
    const text = row[name];
    return text === undefined || text === "" ? NaN : Number(text);
  };
  return {
    east_m: number("east_m"),
    north_m: number("north_m"),
    distance_m: number("distance_m"),
    time_s: number("time_s"),
    altitude_m: number("altitude_m"),
    slope_deg: number("slope_deg"),
    anchor_count: number("anchor_count"),
    dop: number("dop"),
    sigma_m: number("position_sigma_m"),
    bubble_m: number("bubble_radius_m"),
  };
}

/** The line in pieces of one colour. */
export function strip(vertices: readonly Vertex[]): { line: readonly Place[]; colour: string }[] {
  const pieces: { line: Place[]; colour: string }[] = [];
  for (let at = 1; at < vertices.length; at += 1) {
    const [from, to] = [vertices[at - 1] as Vertex, vertices[at] as Vertex];
    const colour = colourOf(to);
    const last = pieces.at(-1);
    if (last?.colour === colour) last.line.push(to);
    else pieces.push({ line: [from, to], colour });
  }
  return pieces;
}

function colourOf(vertex: Vertex): string {
  const limit = mission.value.positioning.dop_limit;
  const { length } = mission.value.anchors;
  const by: Record<Strip, () => number> = {
    plain: () => 0x111111,
    slope: () => stepColour(SLOPE_STEPS, vertex.slope_deg),
    sight: () => countColour(vertex.anchor_count, length),
    dilution: () => stepColour(limitSteps(limit), Number.isNaN(vertex.dop) ? Infinity : vertex.dop),
    error: () => stepColour(limitSteps(1), Number.isNaN(vertex.sigma_m) ? Infinity : vertex.sigma_m),
    bubble: () => stepColour(limitSteps(3), vertex.bubble_m),
  };
  return css(by[stripShown.value]());
}

/** Relax the limit that a remedy names; null where the page has no such limit. */
export function remedy({ reason, needed }: Relaxation): (() => void) | null {
  if (needed === null) return null;
  const { rover, route, positioning } = mission.value;
  if (reason === "slope") return () => change({ rover: { ...rover, max_slope_deg: Math.min(90, Math.ceil(needed * 10) / 10) } });
  if (reason === "anchors in sight") return () => change({ route: { ...route, min_anchors: needed } });
  if (reason === "dilution") return () => change({ positioning: { ...positioning, dop_limit: Math.ceil(needed * 100) / 100 } });
  if (reason === "safety bubble") return () => change({ route: { ...route, bubble_epsilon: needed } });
  return null;
}
