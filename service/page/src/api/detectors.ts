// Detector sessions: opened, listened to, and fed with the epochs of a log.
import { ask, askJson, posted, Refusal } from "./http";
import { words } from "../words";

export interface DetectorLinks {
  readonly self: string;
  readonly epochs: string;
  readonly stream: string;
  /** Of sessions that look at a DEM. */
  readonly map_doubts?: string;
  readonly drive?: string;
}

export interface Detector {
  readonly id: string;
  readonly name: string | null;
  readonly anchors: readonly string[];
  readonly dem_id: string | null;
  readonly map_warnings: readonly string[];
  readonly links: DetectorLinks;
}

export interface Verdict {
  readonly anchor_id: string;
  readonly sight: "clear" | "occluded" | "too short" | "unknown";
  readonly probability: number | null;
  readonly range_m: number | null;
  readonly excess_m: number | null;
  readonly reason: string;
}

export interface Advice {
  readonly at_m: number;
  readonly bubble_m: readonly number[];
  readonly stretches: readonly { readonly from_m: number; readonly to_m: number; readonly in_s: number; readonly for_s: number; readonly fewest: number; readonly hidden: readonly string[] }[];
  readonly speed: { readonly sentence: string } | null;
  /** Where the path leads through what no rover is on, metres along it. */
  readonly obstructed: readonly { readonly from_m: number; readonly to_m: number; readonly what: Obstacle }[];
}

export type Obstacle = "building" | "unknown ground" | "outside the map";

/** A stretch over which the ranges of an anchor contradict the map. */
export interface DoubtFeature {
  readonly geometry: { readonly type: "Point"; readonly coordinates: readonly number[] } | { readonly type: "LineString"; readonly coordinates: readonly (readonly number[])[] };
  readonly properties: {
    readonly anchor_id: string;
    /** What the map has. */
    readonly expected: "in sight" | "hidden";
    readonly from_s: number;
    readonly to_s: number;
    readonly ranges: number;
    readonly bearing_deg: number;
    readonly distance_m: number;
    readonly excess_m: number | null;
    readonly probability: number;
  };
}

export interface DoubtFile {
  readonly features: readonly DoubtFeature[];
}

export interface Epoch {
  readonly advice: Advice | null;
  readonly time_s: number | null;
  readonly rejection: string | null;
  readonly verdicts: readonly Verdict[];
  readonly position: {
    readonly east_m: number | null;
    readonly north_m: number | null;
    readonly altitude_m: number | null;
    readonly covariance_m2: readonly (readonly (number | null)[])[];
    readonly checked: boolean;
  } | null;
  readonly planning: string;
  readonly summary: string;
  readonly needed: string;
  readonly predicted: readonly { readonly anchor_id: string; readonly p_sight: number; readonly p_usable: number | null; readonly clearance_m: number | null }[] | null;
}

/** The epochs of a log as a session takes them. */
export interface RangeLog {
  readonly epochs: readonly unknown[];
  readonly told: readonly string[];
}

const WAIT_S = 30;

export async function listDetectors(): Promise<readonly Detector[]> {
  return (await askJson<{ detectors: readonly Detector[] }>("/detectors")).detectors;
}

export function openDetector(body: unknown): Promise<Detector> {
  return askJson<Detector>("/detectors", posted(body, WAIT_S));
}

export async function sendEpochs(links: DetectorLinks, epochs: readonly unknown[]): Promise<readonly Epoch[]> {
  return (await askJson<{ answers: readonly Epoch[] }>(links.epochs, posted({ epochs }, WAIT_S))).answers;
}

export function readLog(file: File, anchorIds: readonly string[]): Promise<RangeLog> {
  const body = new FormData();
  body.append("file", file);
  const ids = new URLSearchParams(anchorIds.map((id) => ["anchor_id", id]));
  return askJson<RangeLog>(`/range-logs?${ids.toString()}`, { method: "POST", body });
}

/** What lies ahead, with the drone that would help. */
export function adviceOf(links: DetectorLinks): Promise<Advice & { readonly move: { readonly sentence: string } | null }> {
  return askJson(`${links.self}/advice`);
}

/** Where its ranges contradict the map; null where it looks at no map. */
export async function doubtsOf({ map_doubts }: DetectorLinks): Promise<DoubtFile | null> {
  return map_doubts === undefined ? null : askJson<DoubtFile>(map_doubts);
}

/** The path that it is told to follow, (east, north); null without one. */
export async function driveOf({ drive }: DetectorLinks): Promise<readonly (readonly [number, number])[] | null> {
  if (drive === undefined) return null;
  return (await askJson<{ path_m: readonly (readonly [number, number])[] } | null>(drive))?.path_m ?? null;
}

export async function closeDetector(links: DetectorLinks): Promise<void> {
  await ask(links.self, { method: "DELETE" });
}

interface Watcher {
  /** From now on every answer is told. */
  readonly open: () => void;
  readonly told: (epoch: Epoch) => void;
  /** Called once, with why, when there will be no more. */
  readonly over: (why: Error) => void;
}

/** Every answer of a session as it is given. Returns what ends it. */
export function watchDetector(links: DetectorLinks, { open, told, over }: Watcher): () => void {
  const socket = new WebSocket(`${location.origin.replace(/^http/, "ws")}${links.stream}?watch=true`);
  let wanted = true;
  socket.addEventListener("open", () => {
    if (wanted) open();
  });
  socket.addEventListener("message", (event) => {
    if (wanted) told(JSON.parse(String(event.data)) as Epoch);
  });
  socket.addEventListener("close", (event) => {
    if (wanted) over(new Refusal(words.streamOver(event.reason), 0, ""));
  });
  return () => {
    wanted = false;
    socket.close();
  };
}
