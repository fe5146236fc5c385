// Above which height positioning is good enough: the morphing map as arrays; the height flown at is a slider.
import { signal } from "@preact/signals";
import { calculate } from "../api/jobs";
import type { MorphingAnswer } from "../api/types";
import type { Ground } from "../geo/grid";
import { bytesOf, floatsOf } from "../geo/rasters";
import { sightBody } from "../mission/hearing";
import { ground, mission, overlay } from "../state";
import { words } from "../words";
import { working } from "./working";

export interface AirColumns {
  /** Height above the ground from which one may fly, metres; NaN where there is none. */
  readonly aboveGroundM: Float32Array;
  /** 0 nowhere, 1 from the ground up, 2 from aboveGroundM up, 3 closed at the ceiling, 4 outside, 255 unknown. */
  readonly state: Uint8Array;
}

export interface Air extends AirColumns {
  readonly key: string;
  readonly answer: MorphingAnswer;
  readonly downloads: readonly { readonly name: string; readonly href: string; readonly description: string }[];
}

export const air = signal<Air | null>(null);
export const flownAboveGroundM = signal(100);

function question(): Record<string, unknown> | null {
  const { positioning, rover, ceiling_above_ground_m } = mission.value;
  if (!ground.value) return null;
  return {
    dem_id: ground.value.dem.id,
    ...sightBody(mission.value),
    kind: positioning.kind,
    measure: positioning.measure,
    dop_limit: positioning.dop_limit,
    receiver_above_ground_m: rover.receiver_above_ground_m,
    ceiling_above_ground_m,
    mode: "fast",
  };
}

export function isAirCurrent(): boolean {
  return air.value !== null && air.value.key === JSON.stringify(question());
}

export async function askForAir(): Promise<void> {
  const body = question();
  if (body === null) throw new Error(words.chooseGround);
  if (mission.peek().anchors.length === 0) throw new Error(words.placeAnchors);
  const here = ground.peek() as Ground;
  await working("air", async (following) => {
    const job = await calculate<MorphingAnswer>("/morphing-maps", body, following);
    const [[aboveGroundM], [state]] = await Promise.all([floatsOf(job, "above_ground.tif", here), bytesOf(job, "flags.tif", here)]);
    air.value = {
      key: JSON.stringify(body),
      aboveGroundM: aboveGroundM as Float32Array,
      state: state as Uint8Array,
      answer: job.result,
      downloads: job.layers,
    };
    overlay.value = "air";
  });
}
