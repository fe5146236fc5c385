// One question that is asked again and again as the mission changes: one at a time, the newest next, what was
// refused not again unless the reason passes.
import { effect, type Signal } from "@preact/signals";
import type { Ground } from "../geo/grid";
import { AGAIN_MS, isPassing } from "../api/http";
import { accept, dem, refuse, setBusy } from "../state";

interface Wanted {
  readonly key: string;
  readonly on: Ground;
}

interface Question<W extends Wanted, F extends { readonly key: string }> {
  /** What it is called among what is being worked on. */
  readonly work: string;
  readonly answer: Signal<F | null>;
  /** The question as it stands; null where nobody asks. */
  readonly wanted: () => W | null;
  /** Whether the map waits for it, so that it is asked at once. */
  readonly isShown: () => boolean;
  readonly read: (question: W) => Promise<F>;
}

export interface Asking {
  readonly watch: () => void;
  readonly isCurrent: () => boolean;
  /** Whether it was asked and the answer is still to come. */
  readonly awaits: () => boolean;
  readonly timesMs: number[];
}

const SETTLE_MS = 120;

export function asking<W extends Wanted, F extends { readonly key: string }>({ work, answer, wanted, isShown, read }: Question<W, F>): Asking {
  const timesMs: number[] = [];
  let running = false;
  let refusedKey = "";
  let settling: ReturnType<typeof setTimeout> | undefined;

  const isOpen = (now: W | null): now is W => now !== null && answer.peek()?.key !== now.key && now.key !== refusedKey;
  const ask = async (): Promise<void> => {
    const now = wanted();
    if (running || !isOpen(now)) return;
    running = true;
    setBusy(work, null);
    const begun = performance.now();
    try {
      const found = await read(now);
      timesMs.push(performance.now() - begun);
      accept("coverage");
      if (dem.peek()?.id === now.on.dem.id) answer.value = found;
    } catch (error) {
      refuse("coverage", error);
      if (isPassing(error)) await new Promise((resume) => setTimeout(resume, AGAIN_MS));
      else refusedKey = now.key;
    } finally {
      running = false;
      setBusy(work, undefined);
      void ask();
    }
  };
  return {
    watch: () => {
      effect(() => {
        const now = wanted();
        clearTimeout(settling);
        if (now) settling = setTimeout(() => void ask(), isShown() ? 0 : SETTLE_MS);
      });
      effect(() => {
        if (answer.peek() && !answer.peek()?.key.includes(dem.value?.id ?? " ")) answer.value = null;
      });
    },
    isCurrent: () => {
      const now = wanted();
      return now !== null && answer.value?.key === now.key;
    },
    awaits: () => isOpen(wanted()),
    timesMs,
  };
}
