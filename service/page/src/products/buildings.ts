// Buildings on the ground: footprints out of a file, tried by the service before the mission takes them.
import { computed, signal } from "@preact/signals";
import { askJson, posted } from "../api/http";
import type { Place } from "../api/types";
import type { Frame } from "../geo/frames";
import { type Buildings, coverBody } from "../mission/mission";
import { change, frame, ground, mission, notice, setBusy } from "../state";
import { words } from "../words";

type Heights = Pick<Buildings, "level_m" | "default_height_m">;
type Footprints = Pick<Buildings, "name" | "geojson">;
type Position = readonly number[];

interface Feature {
  readonly id?: unknown;
  readonly properties?: Readonly<Record<string, unknown>> | null;
  readonly geometry?: { readonly type: string; readonly coordinates: unknown } | null;
}

/** Read, and not taken yet: the service refused them, for their heights perhaps. */
export const pending = signal<Footprints | null>(null);
const given = signal<Heights>({ level_m: null, default_height_m: null });
/** What is taken where a building tells no height. */
export const heights = computed<Heights>(() => (pending.value ? given.value : (mission.value.buildings ?? given.value)));
/** Bytes of footprints, which are kept within the mission. */
const MOST_BYTES = 400_000;
const WAIT_S = 20;
const TAGS = /^(building|building:part|building:levels|height|min_height|name|id|@id)$/;

/** Whether a file of places holds buildings. */
export async function holdsBuildings(file: File): Promise<boolean> {
  return /\.geojson$/i.test(file.name) && /"building(:part)?"\s*:/.test(await file.text());
}

export async function takeBuildings(file: File): Promise<void> {
  if (!ground.peek()) throw new Error(words.chooseGround);
  const { geojson, kept, passed } = footprintsIn(file.name, await file.text());
  const bytes = JSON.stringify(geojson).length;
  if (bytes > MOST_BYTES) throw new Error(words.buildingsTooLarge(file.name, bytes, MOST_BYTES));
  given.value = heights.peek();
  pending.value = { name: file.name, geojson };
  await tryBuildings(words.buildingsTaken(file.name, kept, passed));
}

/** Other heights for buildings that tell none; what was read is tried with them. */
export async function setHeights(next: Partial<Heights>): Promise<void> {
  given.value = { ...heights.peek(), ...next };
  await tryBuildings("");
}

export function dropBuildings(): void {
  pending.value = null;
  if (mission.peek().buildings !== null) change({ buildings: null });
}

async function tryBuildings(told: string): Promise<void> {
  const [here, from] = [ground.peek(), pending.peek() ?? mission.peek().buildings];
  if (!here || !from) return;
  const { level_m, default_height_m } = given.peek();
  const buildings: Buildings = { name: from.name, geojson: from.geojson, level_m, default_height_m };
  const { west, east, south, north } = here.extent;
  const points = [{ east_m: (west + east) / 2, north_m: (south + north) / 2 }];
  setBusy("buildings", null);
  try {
    const body = { dem_id: here.dem.id, points, anchors: [], ...coverBody(buildings) };
    const { warnings } = await askJson<{ readonly warnings: readonly string[] }>("/probe", posted(body, WAIT_S));
    pending.value = null;
    change({ buildings });
    notice.value = [told, ...warnings].join(" ").trim();
  } finally {
    setBusy("buildings", undefined);
  }
}

/** The polygons of a GeoJSON that are buildings, with the tags that say how high they are. Raises one sentence. */
function footprintsIn(name: string, text: string): { geojson: Buildings["geojson"]; kept: number; passed: number } {
  let document: { readonly features?: unknown; readonly coordinates_are?: unknown };
  try {
    document = JSON.parse(text) as typeof document;
  } catch {
    throw new Error(words.noFootprints(name));
  }
  if (!Array.isArray(document.features)) throw new Error(words.noFootprints(name));
  const all = document.features as readonly Feature[];
  const features = all.filter(isBuilding).map(({ id, properties, geometry }) => ({
    type: "Feature",
    ...(id === undefined ? {} : { id }),
    properties: Object.fromEntries(Object.entries(tagsOf(properties)).filter(([tag]) => TAGS.test(tag))),
    geometry: { type: geometry?.type, coordinates: rounded(geometry?.coordinates) },
  }));
  if (features.length === 0) throw new Error(words.noFootprints(name));
  const metres = document.coordinates_are === undefined ? {} : { coordinates_are: document.coordinates_are };
  return { geojson: { type: "FeatureCollection", ...metres, features }, kept: features.length, passed: all.length - features.length };
}

function tagsOf(properties: Feature["properties"]): Readonly<Record<string, unknown>> {
  const nested = properties?.["tags"];
  return { ...properties, ...(typeof nested === "object" && nested !== null ? nested : {}) };
}

function isBuilding({ properties, geometry }: Feature): boolean {
  const tags = tagsOf(properties);
  const said = [tags["building"], tags["building:part"]].some((value) => value !== undefined && value !== "no");
  return (geometry?.type === "Polygon" || geometry?.type === "MultiPolygon") && (said || tags["height"] !== undefined);
}

/** A hundred-millionth of a degree is a millimetre. */
function rounded(coordinates: unknown): unknown {
  if (Array.isArray(coordinates)) return coordinates.map(rounded);
  return typeof coordinates === "number" ? Math.round(coordinates * 1e8) / 1e8 : coordinates;
}

/** Outlines of the mission's buildings in the metres of the ground. */
export const outlines = computed<readonly (readonly Place[])[]>(() => {
  const [built, here] = [mission.value.buildings, frame.value];
  return built && here ? outlinesOf(built, here) : [];
});

export function outlinesOf({ geojson }: Buildings, here: Frame): Place[][] {
  const metres = geojson["coordinates_are"] === "metres";
  const place = ([x, y]: Position): Place | null => (metres ? { east_m: x ?? 0, north_m: y ?? 0 } : here.toMetres({ lon_deg: x ?? 0, lat_deg: y ?? 0 }));
  return (geojson["features"] as readonly Feature[]).flatMap(({ geometry }) => {
    const polygons = geometry?.type === "Polygon" ? [geometry.coordinates] : geometry?.coordinates;
    return (polygons as readonly (readonly (readonly Position[])[])[]).map(([outer]) => (outer ?? []).map(place).filter((one) => one !== null));
  });
}
