// The map: a bare projection in the metres of the DEM, so that local frames, the Moon and Mars draw like any other.
import { effect } from "@preact/signals";
import OlMap from "ol/Map.js";
import View from "ol/View.js";
import ScaleLine from "ol/control/ScaleLine.js";
import Zoom from "ol/control/Zoom.js";
import { defaults as interactions } from "ol/interaction/defaults.js";
import ImageLayer from "ol/layer/Image.js";
import Projection from "ol/proj/Projection.js";
import ImageCanvasSource from "ol/source/ImageCanvas.js";
import type { Place } from "../api/types";
import { contains, type Ground } from "../geo/grid";
import { type Covered, coveredBy } from "../geo/sample";
import { cursor, ground } from "../state";
import { unit } from "../units";
import { overview } from "../products/library";
import { contourM, opacity, painted } from "./looks";
import { shade } from "./shade";
import { vectorLayers } from "./features";
import { followOverview } from "./overview";
import { followPointer } from "./tools";

export const frameTimesMs: number[] = [];

export function makeMap(target: HTMLElement): OlMap {
  const scale = new ScaleLine({ units: "metric" });
  const map = new OlMap({
    target,
    controls: [new Zoom(), scale],
    interactions: interactions({ altShiftDragRotate: false, pinchRotate: false, doubleClickZoom: false }),
    layers: [],
  });
  effect(() => scale.setUnits(unit.value === "ft" ? "us" : "metric"));
  const raster = new ImageLayer<ImageCanvasSource>();
  map.addLayer(raster);
  for (const layer of vectorLayers()) map.addLayer(layer);
  const showGround = (here: Ground | null): void => {
    raster.setSource(here ? rasterOf(here) : null);
    if (here) show(map, here);
  };
  effect(() => {
    const here = ground.value;
    if (!overview.peek()) showGround(here);
  });
  effect(() => raster.setVisible(!overview.value));
  followOverview(map, () => showGround(ground.peek()));
  effect(() => {
    // read here, so that the raster is drawn anew when any of them changes
    const looks = [painted.value, opacity.value, contourM.value];
    if (looks.length > 0) raster.getSource()?.changed();
  });
  map.on("pointermove", (event) => {
    const [east, north] = event.coordinate;
    if (event.dragging || overview.peek() || east === undefined || north === undefined) return;
    const place: Place = { east_m: east, north_m: north };
    cursor.value = ground.peek() && contains((ground.peek() as Ground).extent, place) ? place : null;
  });
  map.getViewport()?.addEventListener("pointerleave", () => (cursor.value = null));
  followPointer(map);
  return map;
}

function show(map: OlMap, here: Ground): void {
  const { west, south, east, north } = here.extent;
  const extent = [west, south, east, north];
  const projection = new Projection({ code: `dem-${here.dem.id}`, units: "m", extent, metersPerUnit: 1 });
  const cell = Math.min(here.dem.cell_east_m, here.dem.cell_north_m);
  const view = new View({ projection, extent, constrainOnlyCenter: true, showFullExtent: true, minResolution: cell / 20 });
  map.setView(view);
  fit(map, extent);
}

/** The whole ground between the panels, which lie over the map on wide screens. */
export function fit(map: OlMap, extent: readonly number[]): void {
  const wide = (map.getTargetElement()?.clientWidth ?? 0) > 760;
  const padding = wide ? [20, 380, 40, 260] : [10, 10, 10, 10];
  map.getView().fit([...extent], { padding, size: map.getSize() ?? [800, 600] });
}

function rasterOf(here: Ground): ImageCanvasSource {
  const canvas = document.createElement("canvas");
  const context = canvas.getContext("2d", { willReadFrequently: false });
  if (!context) throw new Error("This browser draws no pictures.");
  let seen: { view: string; covered: Covered | null; image: ImageData | null } = { view: "", covered: null, image: null };
  return new ImageCanvasSource({
    ratio: 1,
    projection: `dem-${here.dem.id}`,
    interpolate: false,
    canvasFunction: (extent, resolution, pixelRatio, size) => {
      const begun = performance.now();
      const [width, height] = [Math.round(size[0] as number), Math.round(size[1] as number)];
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      const view = {
        west: extent[0] as number,
        north: extent[3] as number,
        resolution: resolution / pixelRatio,
        width,
        height,
      };
      const now = JSON.stringify(view);
      if (now !== seen.view) {
        const covered = coveredBy(view, here);
        seen = { view: now, covered, image: covered && context.createImageData(covered.width, covered.height) };
        context.clearRect(0, 0, width, height);
      }
      if (seen.covered && seen.image) {
        shade(new Uint32Array(seen.image.data.buffer), seen.covered, here, painted.peek(), opacity.peek(), contourM.peek());
        context.putImageData(seen.image, seen.covered.left, seen.covered.top);
      }
      frameTimesMs.push(performance.now() - begun);
      return canvas;
    },
  });
}
