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

const SILENT = "silent";
/** What was refused for a reason that passes is asked again after so long. */
export const AGAIN_MS = 4000;

/** Whether the service was silent, busy or broken, so that the same may be answered later. */
export function isPassing(error: unknown): boolean {
  return error instanceof Refusal && (error.type === SILENT || error.status === 429 || error.status >= 500);
}

interface Problem {
  readonly detail?: string;
  readonly type?: string;
}

export async function ask(path: string, options: RequestInit = {}): Promise<Response> {
  const files = filesIn(options.body);
  const name = files.length === 0 ? null : await unreadable(files);
  if (name !== null) throw new Refusal(words.fileUnreadable(name), 0, "");
  let answer: Response;
  try {
    answer = await fetch(at(path), options);
  } catch (error) {
    if (options.signal?.aborted) throw error;
    throw silent();
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

export function askText(path: string): Promise<string> {
  return wholeOf(ask(path), (answer) => answer.text());
}

export function askBytes(path: string, options: RequestInit = {}): Promise<ArrayBuffer> {
  return wholeOf(ask(path, options), (answer) => answer.arrayBuffer());
}

export function blobOf(answer: Response): Promise<Blob> {
  return wholeOf(answer, (whole) => whole.blob());
}

/** What the service calls a file that is downloaded. */
export function fileNameIn(disposition: string | null): string | null {
  const [, written] = /filename\*=utf-8''([^;]+)/i.exec(disposition ?? "") ?? [];
  if (written !== undefined) return decodeURIComponent(written);
  return /filename="([^"]+)"/.exec(disposition ?? "")?.[1] ?? null;
}

/** An answer may break off after it has begun. */
async function wholeOf<T>(asked: Response | Promise<Response>, reading: (answer: Response) => Promise<T>): Promise<T> {
  const answer = await asked;
  try {
    return await reading(answer);
  } catch {
    throw silent();
  }
}

const silent = (): Refusal => new Refusal(words.serviceSilent, 0, SILENT);

function filesIn(body: BodyInit | null | undefined): readonly File[] {
  return (body instanceof FormData ? [...body.values()] : [body]).filter((part) => part instanceof File);
}

/** The first that cannot be read: a folder, or a file that is gone or another since it was chosen. */
async function unreadable(files: readonly File[]): Promise<string | null> {
  for (const file of files) {
    try {
      await file.slice(0, 1).arrayBuffer();
    } catch {
      return file.name;
    }
  }
  return null;
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
