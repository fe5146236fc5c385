import { expect, test } from "vitest";
import { cellsOf, tableOf } from "./tables";

test("quoted cells hold commas, quotes and line breaks", () => {
  expect(cellsOf('a,"b, ""c""\nd"\r\n1,2\n')).toEqual([["a", 'b, "c"\nd'], ["1", "2"]]);
});

test("a table is its lines by the names in the first", () => {
  expect(tableOf('id,x\n"D,1",1.5\nD2\n')).toEqual([
    { id: "D,1", x: "1.5" },
    { id: "D2", x: "" },
  ]);
});
