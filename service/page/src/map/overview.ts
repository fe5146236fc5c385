// Where there is ground to be had: outlines of the tiles in degrees, and a box drawn over them.
import { effect } from "@preact/signals";
import Feature from "ol/Feature.js";
import type OlMap from "ol/Map.js";
import Point from "ol/geom/Point.js";
import View from "ol/View.js";
import { boundingExtent } from "ol/extent.js";
import GeoJSON from "ol/format/GeoJSON.js";
import Draw, { createBox } from "ol/interaction/Draw.js";
import VectorLayer from "ol/layer/Vector.js";
import Projection from "ol/proj/Projection.js";
import VectorSource from "ol/source/Vector.js";
import { coverage, overview, takeBox } from "../products/library";
import { tileStyle } from "./styles";

const WORLD = [-180, -90, 180, 90];
const METRES_PER_DEGREE = 111_320;

const tiles = new VectorSource();
/** Where Enter set the first corner of a box. */
let corner: readonly number[] | null = null;

/** The middle of the map is a corner of the box; the second one ends it. */
export function cornerInTheMiddle(map: OlMap): void {
  const middle = map.getView().getCenter();
  if (!middle) return;
  if (corner === null) {
    corner = middle;
    tiles.addFeature(new Feature(new Point([...middle])));
  } else takeBox(boundingExtent([[...corner], middle]));
}

/** Shows it while it is asked for, and the ground again afterwards. */
export function followOverview(map: OlMap, back: () => void): void {
  const layer = new VectorLayer({ source: tiles, zIndex: 40, visible: false });
  map.addLayer(layer);
  const drawing = new Draw({ type: "Circle", geometryFunction: createBox() });
  drawing.on("drawend", (event) => {
    const extent = event.feature.getGeometry()?.getExtent();
    if (extent) takeBox(extent);
  });
  let shown = false;
  effect(() => {
    if (overview.value === shown) return;
    shown = overview.value;
    layer.setVisible(shown);
    if (!shown) {
      map.removeInteraction(drawing);
      back();
      return;
    }
    tiles.clear();
    corner = null;
    tiles.addFeatures(outlines());
    map.addInteraction(drawing);
    const projection = new Projection({ code: "degrees", units: "degrees", extent: WORLD, metersPerUnit: METRES_PER_DEGREE });
    map.setView(new View({ projection, center: [0, 0], zoom: 1, minResolution: 1e-6 }));
    const extent = tiles.getFeatures().length > 0 ? tiles.getExtent() : WORLD;
    map.getView().fit(extent ?? boundingExtent([]), { padding: [60, 400, 60, 280], maxZoom: 14 });
  });
}

function outlines(): Feature[] {
  const features = coverage.peek().features.map(({ geometry, properties }) => ({ type: "Feature", geometry, properties }));
  const read = new GeoJSON().readFeatures({ type: "FeatureCollection", features });
  for (const feature of read) feature.setStyle(tileStyle(String(feature.get("name"))));
  return read;
}
