import { afterEach, beforeAll, beforeEach, expect, test, vi } from "vitest";
import type { Detector, Epoch } from "../api/detectors";
import { refusals } from "../state";
import { doubts, followed, watchDoubts } from "./doubts";
import { leave, openLinks, watch } from "./live";

const links = { self: "/detectors/a", epochs: "/detectors/a/epochs", stream: "/detectors/a/stream", map_doubts: "/detectors/a/map-doubts", drive: "/detectors/a/drive" };
const detector: Detector = { id: "a", name: "drive", anchors: ["D1"], dem_id: "g", map_warnings: [], links };
const lookedAt: Epoch = { advice: null, time_s: 9, rejection: null, verdicts: [], position: null, planning: "", summary: "", needed: "", predicted: null };
const wrong = { geometry: { type: "Point", coordinates: [3, 4] }, properties: { anchor_id: "D1", from_s: 2, to_s: 5 } };

/** A stream that says what the test says. */
class Stream extends EventTarget {
  static last: Stream;
  constructor() {
    super();
    Stream.last = this;
  }
  readonly close = vi.fn();
  tell(): void {
    this.dispatchEvent(Object.assign(new Event("message"), { data: JSON.stringify(lookedAt) }));
  }
  end(): void {
    this.dispatchEvent(Object.assign(new Event("close"), { reason: "It was closed." }));
  }
}

interface Asked {
  readonly path: string;
  readonly answer: (body: unknown, status?: number) => void;
}
let asked: Asked[] = [];

/** Let everything that waits for an answer go on. */
const goOn = () => vi.advanceTimersByTimeAsync(0);

async function answerNext(status = 200): Promise<string> {
  const [next] = asked.splice(0, 1);
  if (!next) throw new Error("nothing was asked");
  next.answer(next.path.endsWith("drive") ? { path_m: [[1, 2], [3, 4]] } : { features: [wrong] }, status);
  await goOn();
  return next.path;
}

beforeAll(watchDoubts);

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal("location", { origin: "http://127.0.0.1" });
  vi.stubGlobal("WebSocket", Stream);
  vi.stubGlobal("fetch", (path: string) => new Promise((answered) => {
    asked.push({ path, answer: (body, status = 200) => answered({ ok: status < 400, status, json: () => Promise.resolve(body) }) });
  }));
  asked = [];
  watch(detector);
  Stream.last.dispatchEvent(new Event("open"));
});

afterEach(async () => {
  leave();
  await vi.advanceTimersByTimeAsync(60_000);
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

test("an open session is asked one thing at a time, and again a while after the answers", async () => {
  expect(asked).toEqual([]);
  for (let epoch = 0; epoch < 20; epoch += 1) Stream.last.tell();
  await vi.advanceTimersByTimeAsync(60_000);
  expect(asked.map(({ path }) => path)).toEqual([links.map_doubts]);
  await answerNext();
  expect(asked.map(({ path }) => path)).toEqual([links.drive]);
  await answerNext();
  expect(doubts.value.map(({ told }) => told.anchor_id)).toEqual(["D1"]);
  expect(followed.value).toEqual([{ east_m: 1, north_m: 2 }, { east_m: 3, north_m: 4 }]);
  expect(asked).toEqual([]);
  await vi.advanceTimersByTimeAsync(3000);
  expect(asked).toHaveLength(1);
  await answerNext();
  await answerNext();
  await vi.advanceTimersByTimeAsync(60_000);
  expect(asked, "no epoch came since").toEqual([]);
});

test("a session that is over is asked nothing, and what was known of it stays", async () => {
  Stream.last.tell();
  await answerNext();
  await answerNext();
  Stream.last.tell();
  Stream.last.end();
  await vi.advanceTimersByTimeAsync(60_000);
  expect(asked).toEqual([]);
  expect(openLinks.value).toBeNull();
  expect(refusals.value.live).toBe("It was closed.");
  expect(doubts.value).toHaveLength(1);
});

test("what is refused on the way when a session ends is the end of its questions", async () => {
  Stream.last.tell();
  Stream.last.end();
  await answerNext(410);
  await vi.advanceTimersByTimeAsync(60_000);
  expect(asked).toEqual([]);
  expect(refusals.value.live).toBe("It was closed.");
  expect(doubts.value).toEqual([]);
});

test("what an open session refuses is told", async () => {
  Stream.last.tell();
  await answerNext(500);
  expect(refusals.value.live).toBe("The service answered 500.");
});
