// The mission as one file, out and in; and kept by the browser as it is.
import { effect } from "@preact/signals";
import { mission } from "../state";
import { words } from "../words";
import { EMPTY_ROUTE, type Mission, NEW_MISSION } from "./mission";

const KEY = "sightline.mission";
const FORMAT = "sightline-mission";

export function missionText(now: Mission): string {
  return JSON.stringify({ format: FORMAT, ...now }, null, 1);
}

/** A mission of a text; fields that an older file lacks have their first values. Raises one sentence. */
export function missionOf(text: string): Mission {
  let read: Partial<Mission> & { format?: string };
  try {
    read = JSON.parse(text) as typeof read;
  } catch {
    throw new Error(words.noMission);
  }
  if (read.format !== FORMAT || read.version !== 1) throw new Error(words.noMission);
  const { format: _, ...given } = read;
  const bad = [...(given.anchors ?? []), given.route?.start, given.route?.goal]
    .filter((one) => one !== null && one !== undefined)
    .some(({ east_m, north_m }) => !Number.isFinite(east_m) || !Number.isFinite(north_m));
  if (bad) throw new Error(words.noMission);
  return {
    ...NEW_MISSION,
    ...given,
    rover: { ...NEW_MISSION.rover, ...given.rover },
    positioning: { ...NEW_MISSION.positioning, ...given.positioning },
    route: { ...EMPTY_ROUTE, ...given.route },
    placing: { ...NEW_MISSION.placing, ...given.placing },
  };
}

/** Keep the mission in this browser after every change. */
export function keepSaving(): void {
  effect(() => localStorage.setItem(KEY, missionText(mission.value)));
}

export function savedMission(): Mission | null {
  const text = localStorage.getItem(KEY);
  if (text === null) return null;
  try {
    return missionOf(text);
  } catch (error) {
    console.warn("The mission kept in this browser cannot be read:", error);
    return null;
  }
}

export function download(name: string, text: string, type: string): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
