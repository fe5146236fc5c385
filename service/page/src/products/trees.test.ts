import { expect, test } from "vitest";
import { coverBody, NEW_MISSION, type Trees } from "../mission/mission";
import { moved } from "../mission/moved";
import { base64Of, saysTrees } from "./trees";

const high: Trees = { what: "top", top_m: 18, name: null, base64: null, base_m: 3, depth_per_m: null };
const raster: Trees = { ...high, what: "heights", top_m: null, name: "crowns.tif", base64: "TQ==", depth_per_m: 0.03 };

test("trees go into questions as one height or as a file, with a density where one is given", () => {
  expect(coverBody(null, high)).toEqual({ cover: { canopy: { top_m: 18, base_m: 3 } } });
  const canopy = { heights: { name: "crowns.tif", base64: "TQ==" }, base_m: 3, model: "density", depth_per_m: 0.03 };
  expect(coverBody(null, raster)).toEqual({ cover: { canopy } });
});

test("bytes are written in base 64 as RFC 4648 has it", () => {
  expect(base64Of(new TextEncoder().encode("foobar"))).toBe("Zm9vYmFy");
  expect(base64Of(new Uint8Array([255, 254]))).toBe("//4=");
});

test("one height holds on any ground, a raster is left behind and named", () => {
  const stay = (place: { east_m: number; north_m: number }) => place;
  expect(moved({ ...NEW_MISSION, trees: high }, stay).mission.trees).toEqual(high);
  expect(moved({ ...NEW_MISSION, trees: raster }, stay)).toEqual({ mission: NEW_MISSION, lost: ["the trees"] });
});

test("rasters that are called after trees hold trees, others are ground", () => {
  expect(["davos_CHM.tif", "tree-heights.tif", "canopyheight.tif", "ndsm_2m.tif", "Trees.tif"].map(saysTrees)).toEqual([true, true, true, true, true]);
  expect(["dem.tif", "streets.tif", "schmidt.tif", "jacksboro.tif"].map(saysTrees)).toEqual([false, false, false, false]);
});
