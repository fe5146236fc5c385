// What is looked at, put together: the painting of the map and its legend.
import { computed, signal } from "@preact/signals";
import { air, flownAboveGroundM } from "../products/air";
import { frame, frames } from "../products/frames";
import { dilution } from "../products/dilution";
import { marginWantedDb, margins } from "../products/margins";
import { isHeard } from "../mission/hearing";
import { after } from "../products/placement";
import { sites } from "../products/sites";
import { surfaces } from "../products/surfaces";
import { ground, mission, overlay, selected } from "../state";
import { type Painting, painting } from "./painters";
import { sharesOf } from "./shade";

export const opacity = signal(0.85);
export const contourM = signal(0);
export const errorLimitM = signal(1);

export const painted = computed<Painting | null>(() => {
  const here = ground.value;
  if (!here) return null;
  const { anchors, placing, rover, rules, positioning } = mission.value;
  const chosen = selected.value ?? anchors[0]?.id ?? null;
  const known = anchors.map((anchor) => surfaces.value.get(anchor.id)).filter((one) => one !== undefined);
  return painting({
    overlay: overlay.value,
    ground: here,
    surfaces: known,
    chosen: (chosen === null ? undefined : surfaces.value.get(chosen)) ?? null,
    dilution: dilution.value,
    heard: isHeard(mission.value),
    margins: margins.value,
    marginWantedDb: marginWantedDb.value,
    air: air.value,
    frames: frames.value?.all ?? [],
    frame: frame.value,
    seen: sites.value?.seen ?? null,
    after: after.value,
    rules,
    soughtM: placing.above_ground_m,
    receiverM: rover.receiver_above_ground_m,
    dopLimit: positioning.dop_limit,
    errorLimitM: errorLimitM.value,
    maxSlopeDeg: rover.max_slope_deg,
    flownAboveGroundM: flownAboveGroundM.value,
  });
});

export interface Legend {
  readonly title: string;
  readonly rows: readonly { readonly colour: number; readonly label: string; readonly share: number }[];
  readonly unknown: number;
}

export function legendOf(): Legend | null {
  const [now, here] = [painted.value, ground.value];
  if (!now || !here) return null;
  const { shares, unknown } = sharesOf(here, now);
  const rows = now.entries.map((entry, number) => ({ ...entry, share: shares[number] ?? 0 }));
  return { title: now.title, rows, unknown };
}
