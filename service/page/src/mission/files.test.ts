import { beforeAll, expect, test, vi } from "vitest";

beforeAll(() => {
  const kept = new Map<string, string>();
  vi.stubGlobal("localStorage", { getItem: (key: string) => kept.get(key) ?? null, setItem: (key: string, text: string) => kept.set(key, text) });
});

test("a mission is the same after it went through its file", async () => {
  const { missionOf, missionText } = await import("./files");
  const { NEW_MISSION, newAnchor } = await import("./mission");
  const mission = { ...NEW_MISSION, name: "Valley", anchors: [newAnchor([], { east_m: 1, north_m: 2 })] };
  expect(missionOf(missionText(mission))).toEqual(mission);
});

test("other JSON, other words and places that are no numbers are no missions", async () => {
  const { missionOf, missionText } = await import("./files");
  const { NEW_MISSION, newAnchor } = await import("./mission");
  for (const text of ["", "{}", '{"format": "sightline-mission", "version": 2}']) expect(() => missionOf(text)).toThrow(/no mission file/);
  const bad = missionText({ ...NEW_MISSION, anchors: [newAnchor([], { east_m: NaN, north_m: 2 })] });
  expect(() => missionOf(bad)).toThrow(/no mission file/);
});
