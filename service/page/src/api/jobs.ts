// A calculation from asking to its result.
import { words } from "../words";
import { AGAIN_MS, ask, askJson, isPassing, posted, Refusal } from "./http";
import type { Job } from "./types";

/** What is quick is answered at once; of the rest the service tells how far it is. */
const WAIT_S = 1;
const BROKEN_MS = 300;
/** A service that starts again goes on with its jobs; one that is silent for longer is given up. */
const MOST_SILENT = 15;
const UNDER_WAY = new Set(["queued", "running"]);

export interface Following {
  /** Called with the finished share, 0..1, whenever it is told. */
  readonly progress?: (share: number | null) => void;
  readonly signal?: AbortSignal;
}

export async function calculate<R>(path: string, body: unknown, following: Following = {}): Promise<Job<R> & { result: R }> {
  let job = await askJson<Job<R>>(path, posted(body, WAIT_S));
  while (UNDER_WAY.has(job.status)) {
    if (following.signal?.aborted) {
      // whoever stops it looks at it no more
      await ask(`${job.links.self}?forget=true`, { method: "DELETE" });
      throw new Refusal(words.cancelled, 0, "cancelled");
    }
    following.progress?.(job.progress);
    await untilOver(job.links.self, following);
    job = await askPatiently<Job<R>>(job.links.self, following);
  }
  const { result } = job;
  if (job.status !== "succeeded" || result === null) {
    throw new Refusal(job.problem?.detail ?? words.calculationIs(job.status), 0, "");
  }
  return { ...job, result };
}

async function askPatiently<T>(self: string, { signal }: Following): Promise<T> {
  for (let silent = 1; ; silent += 1) {
    try {
      return await askJson<T>(self);
    } catch (error) {
      if (!isPassing(error) || silent === MOST_SILENT || signal?.aborted) throw error;
      await new Promise((resume) => setTimeout(resume, AGAIN_MS));
    }
  }
}

/** Follow the service's events until it is over, is to be cancelled, or the events break off and it is asked instead. */
async function untilOver(self: string, { progress, signal }: Following): Promise<void> {
  const events = new EventSource(`${self}/events`);
  const broken = await new Promise<boolean>((resume) => {
    const end = (): void => resume(false);
    events.addEventListener("progress", (event: MessageEvent<string>) => progress?.((JSON.parse(event.data) as { progress: number }).progress));
    events.addEventListener("over", end);
    events.addEventListener("error", () => resume(true));
    signal?.addEventListener("abort", end);
    if (signal?.aborted) end();
  });
  events.close();
  if (broken) await new Promise((resume) => setTimeout(resume, BROKEN_MS));
}

export function layer(job: Job<unknown>, name: string): string {
  const link = job.layers.find((one) => one.name === name);
  if (!link) throw new Refusal(words.layerMissing(name), 0, "");
  return link.href;
}
