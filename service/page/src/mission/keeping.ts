// The mission is saved by itself: after every change, as a version that builds on the one that was opened.
import { at } from "../api/here";
import { effect, signal } from "@preact/signals";
import { getDem } from "../api/dems";
import { AGAIN_MS, isPassing, Refusal } from "../api/http";
import { addMission, addMissionFile, getMission, type Opened, saveMission } from "../api/missions";
import { takeGround, waitFor } from "../ground";
import { accept, change, isFollowing, mission, notice, open } from "../state";
import { store, stored } from "../stored";
import { words } from "../words";
import { type Mission, NEW_MISSION } from "./mission";
import { claimTab, forgetUnsent, keepUnsent, leftBehind, ownUnsent, type Unsent } from "./unsent";

export interface Kept {
  readonly id: string;
  readonly version: number;
}

export type Saving = "new" | "saved" | "unsent" | "saving" | "conflict";
export const kept = signal<Kept | null>(null);
export const saving = signal<Saving>("new");
/** The service's sentence about who saved since. */
export const conflict = signal<string | null>(null);
/** Why it could not be saved, told until it is. */
export const unsaved = signal<string | null>(null);
const NAME = "sightline.name";
const LAST = "sightline.last";
export const who = signal(stored(NAME) ?? "");
effect(() => void store(NAME, who.value));

const SETTLE_MS = 600;
/** The document that the service has. */
let sent: Mission = NEW_MISSION;
let timer: number | undefined;
let underWay: Promise<void> | null = null;
/** Whether what is not sent is lost with this tab. */
let onlyHere = false;

/** Whether something is on its way to the service, or soon will be. */
export function awaitsKeeping(): boolean {
  return saving.peek() === "saving" || (saving.peek() === "unsent" && unsaved.peek() === null);
}

function later(ms: number): void {
  clearTimeout(timer);
  timer = window.setTimeout(() => void save(), ms);
}

function take(told: { id: string; version: number }, document: Mission): void {
  sent = document;
  kept.value = { id: told.id, version: told.version };
  store(LAST, told.id);
  const address = at(`/?mission=${told.id}`);
  if (location.pathname + location.search !== address) history.replaceState(null, "", address);
}

/** Save what is not saved yet, now. */
export function save(): Promise<void> {
  clearTimeout(timer);
  underWay ??= send().finally(() => (underWay = null));
  return underWay;
}

/** What is there is saved when this is over; raises why it is not. */
export async function saved(): Promise<void> {
  await save();
  if (mission.peek() !== sent) await save();
  if (mission.peek() !== sent) throw new Error(conflict.peek() ?? unsaved.peek() ?? words.notSaved);
}

async function send(): Promise<void> {
  const now = mission.peek();
  if (now === sent || saving.peek() === "conflict") return;
  saving.value = "saving";
  try {
    const here = kept.peek();
    const told = here ? await saveMission(here.id, now, here.version, who.peek()) : await addMission(now, who.peek());
    take(told, now);
    [unsaved.value, conflict.value] = [null, null];
  } catch (error) {
    if (!(error instanceof Refusal)) throw error;
    fail(error);
    return;
  }
  if (mission.peek() === now) {
    forgetUnsent();
    saving.value = "saved";
  } else later(SETTLE_MS);
}

function fail(error: Refusal): void {
  if (error.status === 412) {
    conflict.value = error.message;
    saving.value = "conflict";
    return;
  }
  saving.value = "unsent";
  unsaved.value = words.notSavedFor(error.message, onlyHere);
  if (error.status === 404) {
    // deleted by somebody else: what is here goes on as a new one
    kept.value = null;
    later(SETTLE_MS);
  } else if (isPassing(error)) later(AGAIN_MS);
}

/** Undo or redo led back to what the service has before anything else was sent. */
function backToSent(): void {
  if (saving.peek() !== "unsent") return;
  clearTimeout(timer);
  forgetUnsent();
  unsaved.value = null;
  saving.value = kept.peek() === null ? "new" : "saved";
}

function watch(): void {
  effect(() => {
    const now = mission.value;
    if (isFollowing()) return;
    if (now === sent) {
      backToSent();
      return;
    }
    const here = kept.peek();
    onlyHere = !keepUnsent({ id: here?.id ?? null, version: here?.version ?? 0, mission: now, at_ms: Date.now() });
    if (saving.peek() === "conflict") return;
    saving.value = "unsent";
    later(SETTLE_MS);
  });
}

/** Put a mission of the service on the screen, on its ground; without it, once that was uploaded. */
export async function show(told: Opened): Promise<void> {
  if (mission.peek() !== sent) await saved();
  const { ground } = told.mission;
  const opening = (document: Mission): void => {
    take(told, document);
    [conflict.value, unsaved.value, saving.value] = [null, null, "saved"];
    forgetUnsent();
  };
  if (ground === null) {
    opening(told.mission);
    open(told.mission);
  } else if (told.dem_id === null) {
    waitFor(ground, async () => {
      accept("brief");
      await show(await getMission(told.id));
    });
    throw new Error(words.otherGround(ground.name));
  } else await takeGround(getDem(told.dem_id), told.mission, opening);
}

export async function openFile(file: File): Promise<void> {
  const told = await addMissionFile(file, who.peek()).catch((error: unknown) => {
    // neither JSON nor a zip of Sightline, or one of something else
    const isFile = error instanceof Refusal && (error.status === 400 || error.status === 422);
    throw isFile ? new Refusal(words.noMission(file.name, error.message), error.status, error.type) : error;
  });
  await show(told);
  notice.value = [words.opened(told.name), ...told.told].join(" ");
}

/** A mission of its own: what is here goes on under another name, or an empty one. */
export async function begin(next: Mission): Promise<void> {
  if (conflict.peek() === null) await save();
  [kept.value, conflict.value, unsaved.value] = [null, null, null];
  sent = NEW_MISSION;
  saving.value = "new";
  open(next);
}

/** Of two that were saved against each other: mine over theirs, theirs (undo brings mine back), or both. */
export async function settle(choice: "mine" | "theirs" | "both"): Promise<void> {
  const here = kept.peek();
  if (!here) return;
  if (choice === "both") {
    const mine = mission.peek();
    await begin({ ...mine, name: words.copyOf(mine.name) });
    return;
  }
  const told = await getMission(here.id);
  kept.value = { id: here.id, version: told.version };
  conflict.value = null;
  saving.value = "unsent";
  if (choice === "theirs") {
    change(told.mission);
    sent = mission.peek();
    forgetUnsent();
    saving.value = "saved";
  } else await save();
}

/** Open what the address names, or what was open last; what was not sent is sent. */
export async function beginKeeping(): Promise<void> {
  await claimTab();
  const asked = new URLSearchParams(location.search).get("mission");
  const own = ownUnsent();
  watch();
  if (own && (asked === null || asked === own.id)) await resume(own);
  else {
    const last = asked ?? stored(LAST);
    try {
      if (last !== null) await show(await getMission(last));
    } catch (error) {
      if (asked === null && error instanceof Refusal && error.status === 404) store(LAST, null);
      else throw error;
    }
  }
  for (const unsent of await leftBehind()) await recover(unsent);
}

async function resume(unsent: Unsent): Promise<void> {
  const { id, version, mission: document } = unsent;
  const opening = (): void => void (kept.value = id === null ? null : { id, version });
  try {
    if (document.ground) await takeGround(getDem(document.ground.dem_id), document, opening);
    else {
      opening();
      open(document);
    }
  } catch (error) {
    // its ground is gone: the mission shall not go with it
    await recover(unsent);
    forgetUnsent();
    throw error;
  }
}

async function recover({ id, version, mission: unsent }: Unsent): Promise<void> {
  const mine = id !== null && id === kept.peek()?.id;
  try {
    if (id !== null && !mine) await saveMission(id, unsent, version, who.peek());
    else await addMission({ ...unsent, name: words.copyOf(unsent.name) }, who.peek());
  } catch (error) {
    if (!(error instanceof Refusal)) throw error;
    await addMission({ ...unsent, name: words.copyOf(unsent.name) }, who.peek());
  }
  notice.value = words.recovered(unsent.name);
}
