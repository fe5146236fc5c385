// The rover on the map: where it is and how surely, the ranges as rings, the lines as measured and as foretold.
import { effect } from "@preact/signals";
import Feature from "ol/Feature.js";
import Circle from "ol/geom/Circle.js";
import LineString from "ol/geom/LineString.js";
import Point from "ol/geom/Point.js";
import Polygon from "ol/geom/Polygon.js";
import VectorLayer from "ol/layer/Vector.js";
import VectorSource from "ol/source/Vector.js";
import type { Epoch } from "../api/detectors";
import type { Place } from "../api/types";
import { darkAhead, obstructedAhead } from "../products/ahead";
import { doubts } from "../products/doubts";
import { altitudeOf, epoch, placeOf, sighted, trail } from "../products/live";
import { mission } from "../state";
import { aheadStyle, doubtLineStyle, doubtStyle, ellipseStyle, measuredStyle, obstructedStyle, pinStyle, ringStyle, trailStyle } from "./styles";

const CORNERS = 60;
const SIGMAS = 2;
const source = new VectorSource();
const at = ({ east_m, north_m }: Place): number[] => [east_m, north_m];

export function liveLayer(): VectorLayer {
  effect(draw);
  return new VectorLayer({ source, zIndex: 22 });
}

function draw(): void {
  source.clear(true);
  const now = epoch.value;
  const rover = now && placeOf(now);
  const walked = trail.value;
  if (walked.length > 1) add(new LineString(walked.map(at)), trailStyle());
  for (const line of darkAhead.value) add(new LineString(line.map(at)), aheadStyle());
  for (const line of obstructedAhead.value) add(new LineString(line.map(at)), obstructedStyle());
  for (const { told, places } of doubts.value) {
    const middle = places[places.length >> 1];
    const anchor = mission.value.anchors.find(({ id }) => id === told.anchor_id);
    if (!middle) continue;
    if (anchor) add(new LineString([at(middle), at(anchor)]), doubtLineStyle());
    add(places.length > 1 ? new LineString(places.map(at)) : new Point(at(middle)), doubtStyle(told.anchor_id));
  }
  if (!now || !rover) return;
  const altitudeM = now.position?.altitude_m ?? null;
  for (const one of sighted.value) {
    const downM = altitudeM === null ? 0 : altitudeOf(one.anchor) - altitudeM;
    const flatM = one.rangeM === null ? NaN : Math.sqrt(one.rangeM ** 2 - downM ** 2);
    if (flatM > 0) add(new Circle(at(one.anchor), flatM), ringStyle(one.sight));
    add(new LineString([at(rover), at(one.anchor)]), measuredStyle(one.sight, one.foretold));
  }
  const ring = ellipseOf(now, rover);
  if (ring) add(new Polygon([ring]), ellipseStyle());
  add(new Point(at(rover)), pinStyle("rover", ""));
}

function add(geometry: Circle | LineString | Point | Polygon, style: ReturnType<typeof ringStyle> | ReturnType<typeof trailStyle>): void {
  const feature = new Feature<Circle | LineString | Point | Polygon>({ geometry });
  feature.setStyle(style);
  source.addFeature(feature);
}

/** Corners of the ellipse of two sigmas round a place, by the Cholesky factor of its covariance; null where unknown. */
export function ellipseOf({ position }: Epoch, { east_m, north_m }: Place): number[][] | null {
  const [ee, en] = position?.covariance_m2[0] ?? [];
  const nn = position?.covariance_m2[1]?.[1];
  if (typeof ee !== "number" || typeof en !== "number" || typeof nn !== "number" || ee <= 0) return null;
  const l11 = Math.sqrt(ee);
  const l21 = en / l11;
  const l22 = Math.sqrt(Math.max(0, nn - l21 ** 2));
  return Array.from({ length: CORNERS + 1 }, (_, corner) => {
    const [x, y] = [Math.cos((2 * Math.PI * corner) / CORNERS), Math.sin((2 * Math.PI * corner) / CORNERS)];
    return [east_m + SIGMAS * l11 * x, north_m + SIGMAS * (l21 * x + l22 * y)];
  });
}
