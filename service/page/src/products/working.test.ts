import { expect, test } from "vitest";
import { busy } from "../state";
import { stop, working } from "./working";

const untilStopped = (signal: AbortSignal): Promise<never> =>
  new Promise((_, refuse) => signal.addEventListener("abort", () => refuse(new Error("stopped"))));

test("work is told with its share until it is over", async () => {
  const told = await working("sums", ({ progress }) => {
    progress(0.25);
    return Promise.resolve(busy.value["sums"]);
  });
  expect(told).toBe(0.25);
  expect(busy.value).not.toHaveProperty("sums");
});

test("work that is over leaves the newer of its name alone", async () => {
  const older = working("sums", ({ signal }) => untilStopped(signal));
  stop("sums");
  const newer = working("sums", ({ signal }) => untilStopped(signal));
  await expect(older).rejects.toThrow("stopped");
  expect(busy.value).toEqual({ sums: null });
  stop("sums");
  await expect(newer).rejects.toThrow("stopped");
  expect(busy.value).toEqual({});
});

test("what is stopped ends, and nothing else does", async () => {
  const [one, two] = ["one", "two"].map((name) => working(name, ({ signal }) => untilStopped(signal)));
  stop("one");
  await expect(one).rejects.toThrow("stopped");
  expect(busy.value).toEqual({ two: null });
  stop("two");
  await expect(two).rejects.toThrow("stopped");
});
