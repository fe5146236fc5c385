import { expect, test } from "vitest";
import { roundsOf } from "./live";

test("ranges of one time are one epoch, in the order of their times; what is no number is measured and null", () => {
  const text = "time_s,anchor_id,range_m\n2.0,A,10.5\n1.0,A,9.5\n1.0,B,nan\n1.0,,\n";
  expect(roundsOf(text)).toEqual([
    { time_s: 1, ranges: [{ anchor_id: "A", range_m: 9.5 }, { anchor_id: "B", range_m: null }] },
    { time_s: 2, ranges: [{ anchor_id: "A", range_m: 10.5 }] },
  ]);
});

test("a table of something else, and a row without a time, are refused by what they lack", () => {
  expect(() => roundsOf("id,east_m\nA,1\n")).toThrow("time_s, anchor_id, range_m");
  expect(() => roundsOf("time_s,anchor_id,range_m\nsoon,A,1\n")).toThrow("soon");
});
