import { expect, test } from "vitest";
import { cellsOf, tableOf, tableText } from "./tables";

test("quoted cells hold commas, quotes and line breaks", () => {
  expect(cellsOf('a,"b, ""c""\nd"\r\n1,2\n')).toEqual([["a", 'b, "c"\nd'], ["1", "2"]]);
});

test("what is written as a table is read again as it was", () => {
  const rows = [["D,1", 1.5, null], ['say "hi"', -2, 3]];
  expect(tableOf(tableText(["id", "x", "y"], rows))).toEqual([
    { id: "D,1", x: "1.5", y: "" },
    { id: 'say "hi"', x: "-2", y: "3" },
  ]);
});
