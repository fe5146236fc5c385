// What the page knows: the mission with its history, the ground under it, what is looked at.
import { batch, computed, effect, signal } from "@preact/signals";
import type { Place } from "./api/types";
import { type Frame, frameOf } from "./geo/frames";
import type { Ground } from "./geo/grid";
import { begin, changed, type History, redone, undone } from "./mission/history";
import { type Anchor, type Mission, NEW_MISSION } from "./mission/mission";

export const MODES = ["ground", "anchors", "coverage", "path", "air", "live", "brief"] as const;
export type Mode = (typeof MODES)[number];
export const TOOLS = ["look", "anchor", "start", "goal", "way-point", "no-go", "keep-in", "area", "flight", "take-off", "landing", "no-fly", "stand-off", "library"] as const;
export type Tool = (typeof TOOLS)[number];
export const OVERLAYS = ["none", "count", "one", "margin", "signal", "dilution", "error", "slope", "permitted", "sites", "after", "ceiling", "air", "frame", "available"] as const;
export type Overlay = (typeof OVERLAYS)[number];

export const mode = signal<Mode>("ground");
export const tool = signal<Tool>("look");
export const overlay = signal<Overlay>("none");
export const ground = signal<Ground | null>(null);
export const frame = computed<Frame | null>(() => (ground.value ? frameOf(ground.value.dem) : null));
export const selected = signal<string | null>(null);
export const cursor = signal<Place | null>(null);
export const pinned = signal<Place | null>(null);
/** What was refused, by the part of the page where it was asked for. */
export const refusals = signal<Readonly<Partial<Record<Mode, string>>>>({});
export const notice = signal("");
export const busy = signal<Readonly<Record<string, number | null>>>({});

const history = signal<History<Mission>>(begin(NEW_MISSION));
export const mission = computed(() => history.value.present);
export const canUndo = computed(() => history.value.past.length > 0);
export const canRedo = computed(() => history.value.future.length > 0);
/** The DEM that both the map and the mission stand on; null while one of them is being changed. */
export const dem = computed(() => {
  const here = ground.value?.dem;
  return here && mission.value.ground?.dem_id === here.id ? here : null;
});
/** Whether something is being dragged or slid, so that quick and coarse is better than late. */
export const following = signal(false);
let beforeDrag: Mission | null = null;

export function change(next: Partial<Mission>): void {
  const before = beforeDrag ?? history.value.present;
  beforeDrag = null;
  batch(() => {
    following.value = false;
    history.value = changed(history.value, { ...history.value.present, ...next }, before);
  });
}

/** While something is dragged: seen at once, one step of undo when it is let go (change). */
export function follow(next: Partial<Mission>): void {
  beforeDrag ??= history.value.present;
  batch(() => {
    following.value = true;
    history.value = { ...history.value, present: { ...history.value.present, ...next } };
  });
}

/** Whether something is being dragged, and is not let go yet. */
export function isFollowing(): boolean {
  return beforeDrag !== null;
}

export function open(next: Mission): void {
  beforeDrag = null;
  following.value = false;
  history.value = begin(next);
}

/** What is being dragged goes back to where it was; else the last step is taken back. */
export function undo(): void {
  if (beforeDrag !== null) {
    const present = beforeDrag;
    beforeDrag = null;
    batch(() => {
      following.value = false;
      history.value = { ...history.value, present };
    });
    return;
  }
  history.value = undone(history.value);
}

export function redo(): void {
  if (beforeDrag !== null) return;
  history.value = redone(history.value);
}

export function withAnchor(id: string, fields: Partial<Anchor>): Pick<Mission, "anchors"> {
  return { anchors: mission.value.anchors.map((one) => (one.id === id ? { ...one, ...fields } : one)) };
}

export function refuse(where: Mode, error: unknown): void {
  const sentence = error instanceof Error ? error.message : String(error);
  refusals.value = { ...refusals.value, [where]: sentence };
}

export function accept(where: Mode): void {
  if (refusals.value[where] === undefined) return;
  const { [where]: _, ...others } = refusals.value;
  refusals.value = others;
}

/** Run what somebody asked for; a refusal is told where they are. */
export async function attempt(where: Mode, work: () => Promise<void>): Promise<void> {
  accept(where);
  try {
    await work();
  } catch (error) {
    refuse(where, error);
  }
}

export function setBusy(what: string, share: number | null | undefined): void {
  const { [what]: _, ...others } = busy.value;
  busy.value = share === undefined ? others : { ...others, [what]: share };
}

effect(() => {
  const ids = mission.value.anchors.map((anchor) => anchor.id);
  if (selected.value !== null && !ids.includes(selected.value)) selected.value = null;
});
