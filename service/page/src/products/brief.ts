// What a crew takes along on paper, put together from the mission and what was calculated of it.
import { signal } from "@preact/signals";
import { askJson } from "../api/http";
import { pathOf } from "../api/missions";
import type { Place } from "../api/types";
import { type Legend, legendOf } from "../map/looks";
import { mapPicture } from "../map/snapshot";
import { kept, saved } from "../mission/keeping";
import type { RadioName } from "../mission/mission";
import { mission } from "../state";
import { words } from "../words";
import { planned } from "./path";

/** An anchor in every frame; null where nobody knows. Heights in metres: ground and altitude in the DEM's datum. */
export interface AnchorRow extends Place {
  readonly id: string;
  readonly kind: string;
  readonly lon_deg: number | null;
  readonly lat_deg: number | null;
  readonly ground_m: number | null;
  readonly above_ground_m: number | null;
  readonly altitude_m: number | null;
  readonly msl_m: number | null;
  readonly ellipsoid_m: number | null;
  readonly max_range_m: number | null;
  readonly radio: RadioName | null;
}

export interface Sheet {
  readonly picture: string | null;
  readonly legend: Legend | null;
  readonly datum: string | null;
  readonly rows: readonly AnchorRow[];
  readonly made: Date;
}

export const sheet = signal<Sheet | null>(null);

/** Fetch what the page does not have, draw the map for paper; the mission is saved first, so that the sheet is of it. */
export async function prepareSheet(): Promise<void> {
  await saved();
  const here = kept.peek();
  if (!here) throw new Error(words.nothingToSave);
  const told = await askJson<{ vertical_datum: string | null; anchors: readonly AnchorRow[] }>(`${pathOf(here.id)}/files/anchors.json`);
  const { anchors, area, route } = mission.peek();
  const places = [...anchors, ...(area ?? []), route.start, route.goal, ...route.way_points, ...(planned.peek()?.vertices ?? [])];
  const picture = await mapPicture(places.filter((one) => one !== null));
  sheet.value = { picture, legend: legendOf(), datum: told.vertical_datum, rows: told.anchors, made: new Date() };
}
