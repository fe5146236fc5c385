// What files of other programs cannot say of anchors, so that whoever saves one knows what stays behind.
import { words } from "../words";
import type { Anchor } from "./mission";

export type ExportFile = "anchors.csv" | "mission.geojson" | "mission.kml" | "mission.kmz" | "mission.gpx" | "anchors.plan";
export type Detail = "ids" | "kinds" | "radios" | "ranges" | "sectors" | "sigmas" | "flights";

const TABLES: readonly Detail[] = ["ids", "kinds", "radios", "ranges", "sectors", "sigmas"];
const CARRIED: Readonly<Record<ExportFile, readonly Detail[]>> = {
  "anchors.csv": TABLES,
  "mission.geojson": TABLES,
  "mission.kml": TABLES,
  "mission.kmz": TABLES,
  "mission.gpx": ["ids", "kinds"],
  "anchors.plan": [],
};
const HAS: Readonly<Record<Detail, (anchor: Anchor) => boolean>> = {
  ids: () => true,
  kinds: ({ kind }) => kind !== "drone",
  radios: ({ radio }) => radio !== null,
  ranges: ({ max_range_m }) => max_range_m !== null,
  sectors: ({ azimuth_from_deg }) => azimuth_from_deg !== null,
  sigmas: ({ ranging_sigma_m }) => ranging_sigma_m !== 0.1,
  flights: ({ flies_to }) => flies_to.length > 0,
};

/** What the anchors have and a file of that name has no place for. */
export function leftBehind(name: ExportFile, anchors: readonly Anchor[]): readonly Detail[] {
  return (Object.keys(HAS) as Detail[]).filter((detail) => !CARRIED[name].includes(detail) && anchors.some(HAS[detail]));
}

/** The same in a sentence; null where all goes along. */
export function leftBehindTold(name: ExportFile, anchors: readonly Anchor[]): string | null {
  const left = leftBehind(name, anchors);
  return left.length === 0 ? null : words.leftBehind(name, left);
}
