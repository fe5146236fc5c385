// A calculation from asking to its result.
import { words } from "../words";
import { ask, askJson, posted, Refusal } from "./http";
import type { Job } from "./types";

const WAIT_S = 5;
const POLL_MS = 300;
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
      await ask(job.links.self, { method: "DELETE" });
      throw new Refusal(words.cancelled, 0, "cancelled");
    }
    following.progress?.(job.progress);
    await new Promise((resume) => setTimeout(resume, POLL_MS));
    job = await askJson<Job<R>>(job.links.self);
  }
  const { result } = job;
  if (job.status !== "succeeded" || result === null) {
    throw new Refusal(job.problem?.detail ?? words.calculationIs(job.status), 0, "");
  }
  return { ...job, result };
}

export function layer(job: Job<unknown>, name: string): string {
  const link = job.layers.find((one) => one.name === name);
  if (!link) throw new Refusal(words.layerMissing(name), 0, "");
  return link.href;
}
