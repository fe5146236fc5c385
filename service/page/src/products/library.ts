// Ground for any place: the operator's tiles and sources seen in degrees, and a DEM made of an area of them.
import { computed, signal } from "@preact/signals";
import { type Coverage, groundCoverage, makeGroundOf } from "../api/dems";
import { takeGround } from "../ground";
import { boxOf } from "../mission/anchorTexts";
import { attempt, mode, setBusy, tool } from "../state";

export const coverage = signal<Coverage>({ features: [], sources: [] });
/** The source that is asked; empty: the operator's own tiles. */
export const source = signal("");
export const cellM = signal<number | null>(null);
/** The box that was drawn or typed: west, south, east, north in degrees. */
export const borders = signal("");
export const isThereGround = computed(() => coverage.value.features.length + coverage.value.sources.length > 0);
/** Whether the map shows where there is ground, in degrees, in place of the mission. */
export const overview = computed(() => tool.value === "library");

export async function refreshLibrary(): Promise<void> {
  coverage.value = await groundCoverage();
  if (coverage.value.features.length === 0) source.value = coverage.value.sources[0] ?? "";
}

export async function takeOf(area: Readonly<Record<string, number>>): Promise<void> {
  const asked = { area, ...(source.peek() === "" ? {} : { source: source.peek() }), ...(cellM.peek() === null ? {} : { cell_m: cellM.peek() as number }) };
  await takeGround(makeGroundOf(asked, (share) => setBusy("ground", share)));
}

/** A box that was drawn, degrees. */
export function takeBox(extent: readonly number[]): void {
  tool.value = "look";
  mode.value = "ground";
  borders.value = extent.map((degrees) => Math.round(degrees * 1e6) / 1e6).join(", ");
  takeBorders();
}

/** The box as it is typed. */
export function takeBorders(): void {
  void attempt("ground", async () => {
    const [west_deg, south_deg, east_deg, north_deg] = boxOf(borders.peek());
    await takeOf({ west_deg, south_deg, east_deg, north_deg });
  });
}
