// Trees over the ground: one height or a raster file, tried by the service before the mission takes them.
import { signal } from "@preact/signals";
import { askJson, posted } from "../api/http";
import { coverBody, type Trees } from "../mission/mission";
import { change, ground, mission, notice, setBusy } from "../state";
import { words } from "../words";

/** Bytes of a raster, which is kept within the mission. */
const MOST_BYTES = 400_000;
const WAIT_S = 20;
const BARE: Trees = { what: "top", top_m: null, name: null, base64: null, base_m: 0, depth_per_m: null };

/** What rasters of trees are said to hold. */
export const heldByRaster = signal<"heights" | "surface">("heights");

/** Whether a file's name says that it holds trees: canopy height models go by these names. */
export function saysTrees(name: string): boolean {
  return /(^|[^a-z])(chm|ndsm|canopy|crowns?|trees?|vegetation|forest)([^a-z]|height|$)/i.test(name);
}

/** One height of the crowns everywhere; none: no trees. */
export async function setHeight(top_m: number | null): Promise<void> {
  if (top_m === null) dropTrees();
  else await tryTrees({ ...(mission.peek().trees ?? BARE), what: "top", top_m, name: null, base64: null });
}

/** Another base or density of the trees that there are. */
export async function setTrees(next: Partial<Pick<Trees, "base_m" | "depth_per_m">>): Promise<void> {
  const { trees } = mission.peek();
  if (trees === null) throw new Error(words.treesFirst);
  await tryTrees({ ...trees, ...next });
}

export async function takeTrees(file: File, what: "heights" | "surface"): Promise<void> {
  if (file.size > MOST_BYTES) throw new Error(words.treesTooLarge(file.name, file.size, MOST_BYTES));
  const base64 = base64Of(new Uint8Array(await file.arrayBuffer()));
  await tryTrees({ ...(mission.peek().trees ?? BARE), what, top_m: null, name: file.name, base64 });
}

export function dropTrees(): void {
  if (mission.peek().trees !== null) change({ trees: null });
}

export function base64Of(bytes: Uint8Array): string {
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return btoa(text);
}

async function tryTrees(trees: Trees): Promise<void> {
  const here = ground.peek();
  if (!here) throw new Error(words.chooseGround);
  const { west, east, south, north } = here.extent;
  const points = [{ east_m: (west + east) / 2, north_m: (south + north) / 2 }];
  setBusy("trees", null);
  try {
    const body = { dem_id: here.dem.id, points, anchors: [], ...coverBody(mission.peek().buildings, trees) };
    const { warnings } = await askJson<{ readonly warnings: readonly string[] }>("/probe", posted(body, WAIT_S));
    change({ trees });
    if (trees.name !== null) notice.value = [words.treesTaken(trees.name), ...warnings].join(" ");
  } finally {
    setBusy("trees", undefined);
  }
}
