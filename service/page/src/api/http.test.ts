import { expect, test } from "vitest";
import { fileNameIn } from "./http";

test.each([
  ['attachment; filename="Drill 7.mission.zip"', "Drill 7.mission.zip"],
  ["attachment; filename*=utf-8''%C3%9Cbung%201.anchors.plan", "Übung 1.anchors.plan"],
  ["inline", null],
  [null, null],
])("the name in %s", (disposition, name) => {
  expect(fileNameIn(disposition)).toBe(name);
});
