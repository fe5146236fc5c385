// What the service has not got yet lies in this browser, one entry a tab, until it has.
import { store, stored, storedKeys } from "../stored";
import type { Mission } from "./mission";

export interface Unsent {
  /** The mission that it is a change of, null for a new one; and the version that it builds on. */
  readonly id: string | null;
  readonly version: number;
  readonly mission: Mission;
  readonly at_ms: number;
}

const PREFIX = "sightline.unsent.";
const TAB = "sightline.tab";
/** Without locks nobody can tell whether a tab is still open; one that was silent for so long is taken for closed. */
const SILENT_MS = 60_000;
let tab = stored(TAB, "session") ?? crypto.getRandomValues(new Uint32Array(2)).join("");

/** Hold this tab's name for as long as it is open; a tab that is a copy of another gets a name of its own. */
export async function claimTab(): Promise<void> {
  // without a secure context, as over plain HTTP from another machine, a browser has no locks
  const locks = (navigator as Partial<Navigator>).locks;
  const held = (name: string): Promise<boolean> =>
    new Promise((tell) => {
      void locks?.request(PREFIX + name, { ifAvailable: true }, (lock) => {
        tell(lock !== null);
        return lock === null ? undefined : new Promise(() => undefined);
        // a browser that keeps nothing has no locks to give either
      }).catch(() => tell(true));
    });
  if (locks && !(await held(tab))) {
    tab = crypto.getRandomValues(new Uint32Array(2)).join("");
    await held(tab);
  }
  store(TAB, tab, "session");
}

/** Whether the browser had room for it. */
export function keepUnsent(unsent: Unsent): boolean {
  return store(PREFIX + tab, JSON.stringify(unsent));
}

export function forgetUnsent(): void {
  store(PREFIX + tab, null);
}

export function ownUnsent(): Unsent | null {
  return read(PREFIX + tab);
}

/** What tabs left behind that are closed; it is taken out, so that no two tabs send it. */
export async function leftBehind(): Promise<readonly Unsent[]> {
  const locks = (navigator as Partial<Navigator>).locks;
  const held = await locks?.query().catch(() => null);
  const open = held ? new Set(held.held?.map((lock) => lock.name)) : null;
  const found: Unsent[] = [];
  for (const key of storedKeys().filter((one) => one.startsWith(PREFIX) && one !== PREFIX + tab)) {
    const unsent = read(key);
    const closed = open ? !open.has(key) : unsent !== null && Date.now() - unsent.at_ms > SILENT_MS;
    if (!closed) continue;
    store(key, null);
    if (unsent) found.push(unsent);
  }
  return found;
}

function read(key: string): Unsent | null {
  const text = stored(key);
  if (text === null) return null;
  try {
    return JSON.parse(text) as Unsent;
  } catch (error) {
    console.warn("What was not sent cannot be read:", error);
    return null;
  }
}
