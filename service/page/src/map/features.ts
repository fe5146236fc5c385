// The mission's shapes on the map: what can be dragged, what was planned, what would be placed.
import { effect } from "@preact/signals";
import Feature from "ol/Feature.js";
import LineString from "ol/geom/LineString.js";
import Point from "ol/geom/Point.js";
import Polygon from "ol/geom/Polygon.js";
import VectorLayer from "ol/layer/Vector.js";
import VectorSource from "ol/source/Vector.js";
import type { Place } from "../api/types";
import type { Ring, StandOff } from "../mission/mission";
import { outlines } from "../products/buildings";
import { pathLine, blockedAt, strip } from "../products/path";
import { flown } from "../products/flight";
import { flies, frame, placeAt } from "../products/frames";
import { ghosts } from "../products/placement";
import { markedPlace } from "../products/profile";
import { sightOf } from "../products/readout";
import { otherWays, wayShown } from "../products/ways";
import { cursor, mission, mode, pinned, selected } from "../state";
import { words } from "../words";
import { liveLayer } from "./liveFeatures";
import { areaStyle, buildingStyle, flightStyle, flownStyle, ghostStyle, lineStyle, markStyle, pathStyle, pinStyle, standOffStyle, wayStyle } from "./styles";

const built = new VectorSource();
const anchors = new VectorSource();
const places = new VectorSource();
const areas = new VectorSource();
const planned = new VectorSource();
const beside = new VectorSource();
const offered = new VectorSource();
const flights = new VectorSource();
const sight = new VectorSource();

export const anchorLayer = new VectorLayer({ source: anchors, zIndex: 30, updateWhileInteracting: true });
export const placeLayer = new VectorLayer({ source: places, zIndex: 20, updateWhileInteracting: true });
export const ghostLayer = new VectorLayer({ source: offered, zIndex: 25 });
export const wayLayer = new VectorLayer({ source: beside, zIndex: 14 });

const at = ({ east_m, north_m }: Place): number[] => [east_m, north_m];
const mark = (place: Place, fields: Record<string, unknown>): Feature => {
  const feature = new Feature({ geometry: new Point(at(place)), ...fields });
  return feature;
};

export function vectorLayers(): VectorLayer[] {
  const area = new VectorLayer({ source: areas, zIndex: 10 });
  const path = new VectorLayer({ source: planned, zIndex: 15 });
  const lines = new VectorLayer({ source: sight, zIndex: 18, updateWhileInteracting: true });
  effect(drawBuildings);
  effect(drawAnchors);
  effect(drawPlaces);
  effect(drawAreas);
  effect(drawFlights);
  effect(drawPath);
  effect(drawWays);
  effect(drawGhosts);
  effect(drawSight);
  return [new VectorLayer({ source: built, zIndex: 8, style: buildingStyle() }), area, wayLayer, path, lines, new VectorLayer({ source: flights, zIndex: 19 }), liveLayer(), placeLayer, ghostLayer, anchorLayer];
}

function drawBuildings(): void {
  built.clear(true);
  built.addFeatures(outlines.value.map((ring) => new Feature(new Polygon([ring.map(at)]))));
}

function drawAnchors(): void {
  const chosen = selected.value;
  const now = mission.value.anchors;
  const ids = new Set(now.map((anchor) => anchor.id));
  for (const feature of anchors.getFeatures()) if (!ids.has(String(feature.getId()))) anchors.removeFeature(feature);
  for (const anchor of now) {
    let feature = anchors.getFeatureById(anchor.id) as Feature<Point> | null;
    if (!feature) {
      feature = new Feature(new Point(at(anchor)));
      feature.setId(anchor.id);
      anchors.addFeature(feature);
    }
    const [east, north] = feature.getGeometry()?.getCoordinates() ?? [];
    if (east !== anchor.east_m || north !== anchor.north_m) feature.getGeometry()?.setCoordinates(at(anchor));
    feature.setStyle(markStyle(anchor.id, anchor.kind, anchor.id === chosen));
  }
}

function drawPlaces(): void {
  const { flight } = mission.value;
  const { start, goal, way_points } = mission.value.route;
  const shown = [
    ...(start ? [mark(start, { place: "start" })] : []),
    ...(goal ? [mark(goal, { place: "goal" })] : []),
    ...way_points.map((place, number) => mark(place, { place: "way-point", number })),
    ...(flight.start ? [mark(flight.start, { place: "take-off" })] : []),
    ...(flight.goal ? [mark(flight.goal, { place: "landing" })] : []),
  ];
  for (const feature of shown) {
    const [place, number] = [String(feature.get("place")), Number(feature.get("number"))];
    feature.setStyle(pinStyle(place, place === "way-point" ? String(number + 1) : words.place(place)));
  }
  places.clear(true);
  places.addFeatures(shown);
}

function drawAreas(): void {
  const { area, route, rules } = mission.value;
  const polygon = (ring: Ring, what: string): Feature => {
    const first = ring[0] as Place;
    const feature = new Feature({ geometry: new Polygon([[...ring.map(at), at(first)]]), what });
    feature.setStyle(areaStyle(what));
    return feature;
  };
  const standOff = ({ places, distance_m }: StandOff): Feature => {
    const [first, ...rest] = places.map(at);
    const feature = new Feature(rest.length === 0 ? new Point(first as number[]) : new LineString([first as number[], ...rest]));
    feature.setStyle(standOffStyle(distance_m));
    return feature;
  };
  areas.clear(true);
  areas.addFeatures([
    ...(area ? [polygon(area, "area")] : []),
    ...route.no_go.map((ring) => polygon(ring, "no-go")),
    ...route.keep_in.map((ring) => polygon(ring, "keep-in")),
    ...rules.no_fly.map((ring) => polygon(ring, "no-fly")),
    ...rules.stand_off.map(standOff),
  ]);
}

/** What was planned through the air, where anchors fly along, and where they are at the time that is looked at. */
function drawFlights(): void {
  flights.clear(true);
  if (flown.value.length > 1) {
    const line = new Feature(new LineString(flown.value.map(at)));
    line.setStyle(flownStyle());
    flights.addFeature(line);
  }
  const shown = mode.value === "air" ? frame.value : null;
  for (const anchor of mission.value.anchors.filter(flies)) {
    const line = new Feature(new LineString([anchor, ...anchor.flies_to].map(at)));
    line.setStyle(flightStyle());
    flights.addFeature(line);
    if (!shown) continue;
    const there = mark(placeAt(anchor, shown.facts.time_s), {});
    there.setStyle(ghostStyle(anchor.id));
    flights.addFeature(there);
  }
}

function drawPath(): void {
  planned.clear(true);
  const path = pathLine.value;
  for (const piece of strip(path)) {
    const feature = new Feature(new LineString(piece.line.map(at)));
    feature.setStyle(pathStyle(piece.colour));
    planned.addFeature(feature);
  }
  const where = blockedAt.value;
  if (where) {
    const feature = mark(where, {});
    feature.setStyle(pinStyle("blocked", words.blockedHere));
    planned.addFeature(feature);
  }
}

/** The other ways are there to be clicked while one is on the path. */
function drawWays(): void {
  beside.clear(true);
  if (mode.value !== "path") return;
  for (const { number, corners } of otherWays.value) {
    const feature = new Feature({ geometry: new LineString(corners.map(at)), way: number });
    feature.setStyle(wayStyle(number, number === wayShown.value));
    beside.addFeature(feature);
  }
}

function drawGhosts(): void {
  offered.clear(true);
  for (const ghost of ghosts.value) {
    const feature = mark(ghost, { ghost: ghost.id });
    feature.setStyle(ghostStyle(`${ghost.id}?`));
    offered.addFeature(feature);
  }
}

function drawSight(): void {
  sight.clear(true);
  const from = pinned.value ?? cursor.value;
  if (markedPlace.value) {
    const marked = mark(markedPlace.value, {});
    marked.setStyle(pinStyle("marked", ""));
    sight.addFeature(marked);
  }
  if (pinned.value) {
    const pin = mark(pinned.value, {});
    pin.setStyle(pinStyle("pin", ""));
    sight.addFeature(pin);
  }
  if (!from) return;
  for (const seen of sightOf(from)) {
    const line = new Feature(new LineString([at(from), at(seen.anchor)]));
    line.setStyle(lineStyle(seen.verdict));
    sight.addFeature(line);
  }
}
