import { expect, test } from "vitest";
import { begin, changed, redone, undone } from "./history";

test("undo returns to each earlier document, redo to each later one", () => {
  let history = changed(changed(begin("a"), "b"), "c");
  history = undone(history);
  expect(history.present).toBe("b");
  history = undone(history);
  expect(history.present).toBe("a");
  expect(undone(history)).toBe(history);
  history = redone(redone(history));
  expect(history.present).toBe("c");
  expect(redone(history)).toBe(history);
});

test("a change after undo forgets what was undone", () => {
  const history = changed(undone(changed(begin("a"), "b")), "c");
  expect(history.future).toEqual([]);
  expect(undone(history).present).toBe("a");
});

test("a drag of many steps is one step of undo, to where it began", () => {
  const start = begin("at rest");
  const followed = { ...start, present: "half way" };
  const history = changed(followed, "there", "at rest");
  expect(undone(history).present).toBe("at rest");
});
