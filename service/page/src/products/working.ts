// What takes a while: told in the bar until it is over, and stopped by whoever asked for it.
import type { Following } from "../api/jobs";
import { setBusy } from "../state";

const stoppers = new Map<string, AbortController>();

/** Work under a name, of which stop(name) ends the newest. */
export async function working<T>(name: string, work: (following: Required<Following>) => Promise<T>): Promise<T> {
  const stopper = new AbortController();
  stoppers.set(name, stopper);
  setBusy(name, null);
  try {
    return await work({ progress: (share) => setBusy(name, share), signal: stopper.signal });
  } finally {
    // the name is the newer work's where that began before this was over
    if (stoppers.get(name) === stopper) {
      stoppers.delete(name);
      setBusy(name, undefined);
    }
  }
}

export function stop(name: string): void {
  stoppers.get(name)?.abort();
}
