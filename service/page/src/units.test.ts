import { expect, test } from "vitest";
import { probability } from "./units";

test("a probability is never told as certain, and stays on one line", () => {
  expect(probability(0.5)).toBe("50.0\u00a0%");
  expect(probability(0.9996)).toBe(">\u00a099.9\u00a0%");
});
