// Anchors as text: a line typed or pasted, a CSV table, GeoJSON; metres of the DEM or degrees.
import type { Place } from "../api/types";
import type { Degrees, Frame } from "../geo/frames";
import { contains, type Extent } from "../geo/grid";
import { words } from "../words";
import { type Anchor, newAnchor, nextId, RADIO_NAMES } from "./mission";
import { cellsOf, tableOf } from "./tables";

interface Around {
  readonly extent: Extent;
  readonly frame: Frame;
}

interface Written {
  readonly value: number;
  readonly towards: string | undefined;
}

/** The numbers of a text, negative towards south and west. */
function numbersIn(text: string): readonly Written[] {
  return [...text.matchAll(/([-+−]?\d+(?:\.\d+)?)\s*°?\s*([NSEW])?/gi)].map(([, digits, letter]) => {
    const value = Number(String(digits).replace("−", "-"));
    const towards = letter?.toUpperCase();
    return { value: towards === "S" || towards === "W" ? -Math.abs(value) : value, towards };
  });
}

/** The first two of them. Raises one sentence. */
function twoNumbers(text: string): readonly [Written, Written] {
  const [first, second] = numbersIn(text);
  if (!first || !second) throw new Error(words.noPlaceIn(text));
  return [first, second];
}

/** Latitude and longitude as people write them. Raises one sentence. */
export function degreesOf(text: string): Degrees {
  const [first, second] = twoNumbers(text);
  const swapped = first.towards === "E" || first.towards === "W";
  const [lat_deg, lon_deg] = swapped ? [second.value, first.value] : [first.value, second.value];
  if (Math.abs(lat_deg) > 90 || Math.abs(lon_deg) > 360) throw new Error(words.outside(text));
  return { lon_deg, lat_deg };
}

/** [west, south, east, north] of a box, degrees; east is below west where it lies over the antimeridian. Raises one sentence. */
export function boxOf(text: string): readonly [number, number, number, number] {
  const [west, south, east, north, more] = numbersIn(text).map(({ value }) => value);
  const missing = west === undefined || south === undefined || east === undefined || north === undefined;
  if (missing || more !== undefined || Math.max(Math.abs(west), Math.abs(east)) > 360 || south < -90 || north > 90 || south >= north || west === east) {
    throw new Error(words.noBox(text));
  }
  return [west, south, east, north];
}

/** One place as people write it: "east north" in metres or "lat lon" in degrees, with or without letters. */
export function placeOf(text: string, { extent, frame }: Around): Place {
  const [first, second] = twoNumbers(text);
  const metres = { east_m: first.value, north_m: second.value };
  if (first.towards === undefined && contains(extent, metres)) return metres;
  const place = frame.toMetres(degreesOf(text));
  if (place === null) throw new Error(words.noDegrees);
  if (!contains(extent, place)) throw new Error(words.outside(text));
  return { east_m: Math.round(place.east_m * 100) / 100, north_m: Math.round(place.north_m * 100) / 100 };
}

/** Anchors of a text, each after those that are there: a table, GeoJSON, or a place per line. */
export function anchorsOf(text: string, there: readonly Anchor[], around: Around): Anchor[] {
  const trimmed = text.trim();
  if (trimmed.startsWith("{")) return fromGeoJson(trimmed, there, around);
  const [head] = cellsOf(trimmed);
  if (head?.some((name) => /^\s*(east_m|lon_deg|lat_deg)\s*$/.test(name))) return fromTable(trimmed, there, around);
  const added: Anchor[] = [];
  for (const line of trimmed.split(/\n/).filter((one) => one.trim() !== "")) {
    added.push(newAnchor([...there, ...added], placeOf(line, around)));
  }
  if (added.length === 0) throw new Error(words.noPlaceIn(text));
  return added;
}

type Fields = Readonly<Record<string, unknown>>;

function fromTable(text: string, there: readonly Anchor[], around: Around): Anchor[] {
  const added: Anchor[] = [];
  for (const row of tableOf(text)) added.push(fromFields(row, null, [...there, ...added], around));
  return added;
}

function fromGeoJson(text: string, there: readonly Anchor[], around: Around): Anchor[] {
  let read: { features?: readonly { geometry?: { type?: string; coordinates?: number[] }; properties?: Fields; id?: unknown }[] };
  try {
    read = JSON.parse(text) as typeof read;
  } catch {
    throw new Error(words.noGeoJson);
  }
  const added: Anchor[] = [];
  for (const { geometry, properties, id } of read.features ?? []) {
    if (geometry?.type !== "Point") continue;
    const [lon, lat] = geometry.coordinates ?? [];
    added.push(fromFields({ id, ...properties }, [lon ?? NaN, lat ?? NaN], [...there, ...added], around));
  }
  if (added.length === 0) throw new Error(words.noGeoJson);
  return added;
}

function fromFields(fields: Fields, point: readonly [number, number] | null, there: readonly Anchor[], around: Around): Anchor {
  const number = (name: string): number | null => {
    const value = textOf(fields[name]);
    if (value === "") return null;
    if (!Number.isFinite(Number(value))) throw new Error(words.noNumber(name, value));
    return Number(value);
  };
  const asked = textOf(fields["id"]);
  const free = asked !== "" && !there.some((one) => one.id === asked);
  const [east, north] = [number("east_m"), number("north_m")];
  const [lon, lat] = [point?.[0] ?? number("lon_deg"), point?.[1] ?? number("lat_deg")];
  let place: Place | null = east === null || north === null ? null : { east_m: east, north_m: north };
  if (place === null && lon !== null && lat !== null) {
    place = around.frame.toMetres({ lon_deg: lon, lat_deg: lat });
    // of a local frame GeoJSON holds metres, and says so
    place ??= { east_m: lon, north_m: lat };
  }
  if (place === null || !contains(around.extent, place)) throw new Error(words.outside(asked || "?"));
  const [above, altitude] = [number("above_ground_m"), number("altitude_m")];
  const base = newAnchor(there, place);
  const kind = ["drone", "mast", "beacon"].includes(textOf(fields["kind"])) ? (fields["kind"] as Anchor["kind"]) : base.kind;
  return {
    ...base,
    id: free ? asked : nextId(there),
    kind,
    height_m: above ?? altitude ?? base.height_m,
    height_from: above === null && altitude !== null ? "altitude_m" : "above_ground_m",
    max_range_m: number("max_range_m"),
    azimuth_from_deg: number("azimuth_from_deg"),
    azimuth_to_deg: number("azimuth_to_deg"),
    ranging_sigma_m: number("ranging_sigma_m") ?? base.ranging_sigma_m,
    radio: RADIO_NAMES.find((name) => name === textOf(fields["radio"])) ?? base.radio,
  };
}

function textOf(value: unknown): string {
  return typeof value === "string" || typeof value === "number" ? String(value).trim() : "";
}
