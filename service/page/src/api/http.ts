// Asking the service. What it refuses, and what does not arrive, becomes a Refusal whose message is one sentence.
import { words } from "../words";
import { at } from "./here";

export class Refusal extends Error {
  constructor(
    message: string,
    readonly status: number,
    readonly type: string,
  ) {
    super(message);
    this.name = "Refusal";
  }
}

interface Problem {
  readonly detail?: string;
  readonly type?: string;
}

export async function ask(path: string, options: RequestInit = {}): Promise<Response> {
  let answer: Response;
  try {
    answer = await fetch(at(path), options);
  } catch (error) {
    if (options.signal?.aborted) throw error;
    throw new Refusal(words.serviceSilent, 0, "");
  }
  if (answer.ok) return answer;
  // the service wants a key: the login brings one, and comes back here
  if (answer.status === 401) window.location.assign(at("/login"));
  const problem = await read<Problem>(answer);
  throw new Refusal(problem.detail ?? words.serviceAnswered(answer.status), answer.status, problem.type ?? "");
}

export async function askJson<T>(path: string, options: RequestInit = {}): Promise<T> {
  return read<T>(await ask(path, options));
}

export function posted(body: unknown, waitS: number, signal?: AbortSignal): RequestInit {
  const headers = { "Content-Type": "application/json", Prefer: `wait=${waitS}` };
  return { method: "POST", headers, body: JSON.stringify(body), ...(signal ? { signal } : {}) };
}

async function read<T>(answer: Response): Promise<T> {
  try {
    return (await answer.json()) as T;
  } catch {
    throw new Refusal(words.serviceUnreadable(answer.status), answer.status, "");
  }
}
