// How much of the ground each place would see as an anchor's: where to look before more are sought.
import { signal } from "@preact/signals";
import { ask } from "../api/http";
import { calculate } from "../api/jobs";
import type { Summary } from "../api/types";
import { floatsOf } from "../geo/rasters";
import { ground, mission, overlay } from "../state";
import { words } from "../words";
import { working } from "./working";

export interface Sites {
  readonly key: string;
  /** Part of the ground that shall be seen, 0..1, that a site over each kept post surely sees; NaN unknown. */
  readonly seen: Float32Array;
  readonly answer: Summary;
}

export const sites = signal<Sites | null>(null);

function question(): Record<string, unknown> {
  const { area, placing, rover, rules } = mission.value;
  if (!ground.value) throw new Error(words.chooseGround);
  return {
    dem_id: ground.value.dem.id,
    site_above_ground_m: placing.above_ground_m,
    receiver_above_ground_m: rover.receiver_above_ground_m,
    ...(area ? { target_area: { ring: area } } : {}),
    ...(rules.max_range_m === null ? {} : { max_range_m: rules.max_range_m }),
    sites: 0,
  };
}

export function areSitesCurrent(): boolean {
  return ground.value !== null && sites.value?.key === JSON.stringify(question());
}

export async function askForSites(): Promise<void> {
  const body = question();
  const here = ground.peek();
  if (!here) return;
  await working("sites", async (following) => {
    const job = await calculate<Summary>("/site-maps", body, following);
    const [seen] = await floatsOf(job, "seen.tif", here);
    sites.value = { key: JSON.stringify(body), seen: seen as Float32Array, answer: job.result };
    overlay.value = "sites";
    await ask(job.links.self, { method: "DELETE" });
  });
}
