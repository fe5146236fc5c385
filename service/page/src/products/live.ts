// A detector session on the map: its answers as they come, or those of a log, and which of them is looked at.
import { computed, signal } from "@preact/signals";
import { closeDetector, type Detector, type DetectorLinks, type Epoch, listDetectors, openDetector, readLog, sendEpochs, watchDetector } from "../api/detectors";
import { Refusal } from "../api/http";
import type { Place } from "../api/types";
import { heightAt } from "../geo/grid";
import { isHeard } from "../mission/hearing";
import { type Anchor, coverBody, radioBody } from "../mission/mission";
import { ground, mission, notice, refuse } from "../state";
import { words } from "../words";
import { fixNeeds } from "./dark";
import { isPathCurrent, pathLine } from "./path";
import { thinned } from "./placement";
import { working } from "./working";

export const sessions = signal<readonly Detector[]>([]);
/** What is watched: a session, or a log by its name. */
export const watched = signal<{ readonly name: string; readonly detector: Detector | null } | null>(null);
/** Of the session that is watched, while its stream is open: then it may be asked for more. */
export const openLinks = signal<DetectorLinks | null>(null);
export const epochs = signal<readonly Epoch[]>([]);
/** Number of the epoch that is looked at; null: the newest, whatever comes. */
export const lookedAt = signal<number | null>(null);
const MOST_EPOCHS = 20_000;
const EPOCHS_AT_ONCE = 100;
let stop: (() => void) | null = null;

export const epoch = computed<Epoch | null>(() => epochs.value[lookedAt.value ?? epochs.value.length - 1] ?? null);

export interface Sighted {
  readonly anchor: Anchor;
  readonly sight: "clear" | "occluded" | "too short" | "unknown";
  readonly rangeM: number | null;
  readonly excessM: number | null;
  readonly reason: string;
  /** Probability of sight that the map foretold, 0..1; null without a map. */
  readonly foretold: number | null;
  /** The same of enough of its radio's signal; null where nobody looks at that. */
  readonly usable: number | null;
}

/** The anchors of the epoch that the mission knows, each with what was measured and what was foretold. */
export const sighted = computed<readonly Sighted[]>(() => {
  const now = epoch.value;
  if (!now) return [];
  return now.verdicts.flatMap(({ anchor_id, sight, range_m, excess_m, reason }) => {
    const anchor = mission.value.anchors.find(({ id }) => id === anchor_id);
    const one = now.predicted?.find((other) => other.anchor_id === anchor_id);
    return anchor ? [{ anchor, sight, rangeM: range_m, excessM: excess_m, reason, foretold: one?.p_sight ?? null, usable: one?.p_usable ?? null }] : [];
  });
});

export const trail = computed<readonly Place[]>(() => {
  const last = lookedAt.value ?? epochs.value.length - 1;
  return epochs.value.slice(0, last + 1).flatMap((one) => placeOf(one) ?? []);
});

export function placeOf(one: Epoch): Place | null {
  const { east_m, north_m } = one.position ?? { east_m: null, north_m: null };
  return east_m === null || north_m === null ? null : { east_m, north_m };
}

/** Altitude of an anchor in the DEM's datum, metres; NaN over unknown ground. */
export function altitudeOf(anchor: Anchor): number {
  const here = ground.value;
  if (anchor.height_from === "altitude_m") return anchor.height_m;
  return here ? heightAt(here, anchor) + anchor.height_m : NaN;
}

/** The path that a session is told to look along; none where none is planned for the mission as it is. */
function driveBody(): Record<string, unknown> {
  const { rover, positioning, anchors } = mission.peek();
  if (!isPathCurrent() || pathLine.peek().length < 2) return {};
  return {
    drive: {
      path_m: thinned(pathLine.peek()).map(({ east_m, north_m }) => [east_m, north_m]),
      speed_m_per_s: rover.speed_m_per_s,
      max_speed_m_per_s: 2 * rover.speed_m_per_s,
      min_anchors: fixNeeds(positioning),
      movable: anchors.filter(({ kind }) => kind === "drone").map(({ id }) => id),
    },
  };
}


function question(name: string): Record<string, unknown> {
  const here = ground.peek();
  const { anchors, buildings, rover, trees } = mission.peek();
  const heard = isHeard(mission.peek());
  if (!here) throw new Error(words.chooseGround);
  if (anchors.length === 0) throw new Error(words.placeAnchors);
  const placed = anchors.map((anchor) => ({ id: anchor.id, east_m: anchor.east_m, north_m: anchor.north_m, altitude_m: altitudeOf(anchor), ...(heard ? radioBody(anchor) : {}) }));
  const lost = placed.find(({ altitude_m }) => Number.isNaN(altitude_m));
  if (lost) throw new Error(words.noAltitude(lost.id));
  const range_sigma_m = Math.max(...anchors.map((anchor) => anchor.ranging_sigma_m));
  return { ...driveBody(), name, anchors: placed, dem_id: here.dem.id, ...coverBody(buildings, heard ? trees : null), antenna_above_ground_m: rover.receiver_above_ground_m, settings: { range_sigma_m } };
}

export async function refreshSessions(): Promise<void> {
  sessions.value = await listDetectors();
}

/** A session with the mission's anchors and ground, for a rover to send its ranges to. */
export async function openSession(): Promise<void> {
  const detector = await openDetector(question(mission.peek().name));
  await refreshSessions();
  watch(detector);
}

export function watch(detector: Detector): void {
  leave();
  watched.value = { name: detector.name ?? detector.id, detector };
  stop = watchDetector(detector.links, {
    open: () => (openLinks.value = detector.links),
    told: (epoch) => {
      if (epoch.rejection === null) epochs.value = [...epochs.value, epoch].slice(-MOST_EPOCHS);
    },
    over: (why) => {
      openLinks.value = null;
      refuse("live", why);
    },
  });
}

/** Listen no more; the session itself goes on. */
export function leave(): void {
  stop?.();
  stop = null;
  [openLinks.value, watched.value, epochs.value, lookedAt.value] = [null, null, [], null];
}

/** A range log judged by a session of its own, from its first epoch to its last; what else that knows is read before it is closed. */
export async function replay(file: File, readBesides: (links: DetectorLinks) => Promise<void>): Promise<void> {
  const body = question(file.name);
  const { epochs: rounds, told } = await readLog(file, mission.peek().anchors.map(({ id }) => id));
  leave();
  await working("replay", async ({ progress, signal }) => {
    const detector = await openDetector(body);
    try {
      const answers: Epoch[] = [];
      for (let at = 0; at < rounds.length; at += EPOCHS_AT_ONCE) {
        if (signal.aborted) throw new Refusal(words.cancelled, 0, "cancelled");
        answers.push(...(await sendEpochs(detector.links, rounds.slice(at, at + EPOCHS_AT_ONCE))));
        progress(answers.length / rounds.length);
      }
      watched.value = { name: file.name, detector: null };
      await readBesides(detector.links);
      epochs.value = answers.filter(({ rejection }) => rejection === null);
      lookedAt.value = 0;
      notice.value = [words.replayed(file.name, answers.length, answers.length - epochs.value.length), ...told].join(" ");
    } finally {
      await closeDetector(detector.links);
    }
  });
}
