// Seen or heard: whether maps are of what is in sight or of usable signals, and what questions say of it.
import { type Anchor, anchorBody, type Buildings, coverBody, heardBody, type Mission, type Trees } from "./mission";

type Asked = Pick<Mission, "anchors" | "positioning" | "buildings" | "trees">;

/** The anchors of which nobody knows what they send. */
export function silent({ anchors }: Pick<Mission, "anchors">): readonly string[] {
  return anchors.filter(({ radio }) => radio === null).map(({ id }) => id);
}

/** Whether maps are of usable signals: that is asked for, and every anchor has a radio. */
export function isHeard(mission: Pick<Mission, "anchors" | "positioning">): boolean {
  return mission.positioning.sight === "usable" && mission.anchors.length > 0 && silent(mission).length === 0;
}

/** What a question about what is seen or heard of some anchors says of them, and of what stands in the way. */
export function sightBody(mission: Asked, { anchors = mission.anchors, heard = isHeard(mission) }: { readonly anchors?: readonly Anchor[]; readonly heard?: boolean } = {}): Record<string, unknown> {
  const { buildings, trees } = mission;
  if (!heard) return { anchors: anchors.map(anchorBody), ...coverBody(buildings) };
  return { anchors: anchors.map(heardBody), sight: "usable", ...coverBody(buildings, trees) };
}

/** The same in short, for keys of what is calculated while something is dragged. */
export function sightKey(mission: Asked, anchors: readonly Anchor[] = mission.anchors): unknown[] {
  const { buildings, trees } = mission;
  if (!isHeard(mission)) return [anchors.map(anchorBody), keyOf(buildings)];
  return [anchors.map(heardBody), "usable", keyOf(buildings), keyOf(trees)];
}

const numbers = new WeakMap<Buildings | Trees, number>();
let given = 0;

/** The same number for the same thing, which may be long. */
function keyOf(thing: Buildings | Trees | null): number {
  if (thing === null) return 0;
  const number = numbers.get(thing) ?? (given += 1);
  numbers.set(thing, number);
  return number;
}
