// The map as a picture for paper: all that the mission draws, at a size of its own, whatever the window shows.
import type OlMap from "ol/Map.js";
import type { Place } from "../api/types";

const WIDTH_PX = 1000;
const HEIGHT_PX = 680;
/** Beyond what is drawn, so that labels have room and the place can be told. */
const MARGIN = 0.25;
let shown: OlMap | null = null;

export function remember(map: OlMap): void {
  shown = map;
}

export function shownMap(): OlMap | null {
  return shown;
}

/** A PNG as data URL of the map round these places, the whole of what is seen without any; null without a map. */
export async function mapPicture(places: readonly Place[]): Promise<string | null> {
  const map = shown;
  if (!map) return null;
  const view = map.getView();
  const before = { size: map.getSize(), center: view.getCenter(), resolution: view.getResolution() };
  map.setSize([WIDTH_PX, HEIGHT_PX]);
  if (places.length > 1) {
    const [east, north] = [places.map((one) => one.east_m), places.map((one) => one.north_m)];
    const [west_m, south_m, east_m, north_m] = [Math.min(...east), Math.min(...north), Math.max(...east), Math.max(...north)];
    const more = MARGIN * Math.max(east_m - west_m, north_m - south_m);
    view.fit([west_m - more, south_m - more, east_m + more, north_m + more], { size: [WIDTH_PX, HEIGHT_PX] });
  }
  const drawn = new Promise<string>((tell) => map.once("rendercomplete", () => tell(composed(map))));
  map.renderSync();
  const picture = await drawn;
  map.setSize(before.size);
  view.setCenter(before.center);
  view.setResolution(before.resolution);
  return picture;
}

function composed(map: OlMap): string {
  const paper = Object.assign(document.createElement("canvas"), { width: WIDTH_PX, height: HEIGHT_PX });
  const context = paper.getContext("2d");
  if (!context) throw new Error("This browser draws no pictures.");
  context.fillStyle = "#fff";
  context.fillRect(0, 0, WIDTH_PX, HEIGHT_PX);
  for (const canvas of (map.getViewport() ?? document).querySelectorAll<HTMLCanvasElement>(".ol-layer canvas, canvas.ol-layer")) {
    if (canvas.width === 0) continue;
    context.globalAlpha = Number((canvas.parentElement?.style.opacity ?? "") || 1);
    const matrix = /^matrix\(([^)]*)\)$/.exec(canvas.style.transform)?.[1]?.split(",").map(Number) ?? [];
    const [a = WIDTH_PX / canvas.width, b = 0, c = 0, d = HEIGHT_PX / canvas.height, e = 0, f = 0] = matrix;
    context.setTransform(a, b, c, d, e, f);
    context.drawImage(canvas, 0, 0);
  }
  return paper.toDataURL("image/png");
}
