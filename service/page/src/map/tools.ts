// What the pointer does on the map: it places, drags, draws and pins, as the tool in hand says.
import { effect } from "@preact/signals";
import type Feature from "ol/Feature.js";
import type OlMap from "ol/Map.js";
import Point from "ol/geom/Point.js";
import type LineString from "ol/geom/LineString.js";
import Polygon from "ol/geom/Polygon.js";
import Draw from "ol/interaction/Draw.js";
import Translate from "ol/interaction/Translate.js";
import type { Place } from "../api/types";
import { contains } from "../geo/grid";
import { type Mission, newAnchor, type Ring } from "../mission/mission";
import { overview } from "../products/library";
import { acceptGhost } from "../products/placement";
import { wayShown } from "../products/ways";
import { accept, change, follow, ground, isFollowing, mission, mode, pinned, selected, type Tool, tool, withAnchor } from "../state";
import { anchorLayer, ghostLayer, placeLayer, wayLayer } from "./features";
import { cornerInTheMiddle } from "./overview";

const CLICKED: readonly unknown[] = [anchorLayer, ghostLayer, wayLayer];
const TOUCHED: readonly unknown[] = [...CLICKED, placeLayer];
const FIRST_STAND_OFF_M = 100;
const PLACES = new Set(["start", "goal", "way-point", "flight", "take-off", "landing"]);
const SHAPES: ReadonlySet<string> = new Set(["no-go", "keep-in", "area", "no-fly", "stand-off"]);

/** A click is no finer than a tenth of a cell. */
function rounded(coordinate: readonly number[]): Place {
  const dem = ground.peek()?.dem;
  const grain = dem && dem.cell_east_m >= 5 ? 1 : 10;
  const [east_m, north_m] = coordinate.map((metres) => Math.round(metres * grain) / grain);
  return { east_m: east_m ?? 0, north_m: north_m ?? 0 };
}

/** The click that ends a drawing is no other click. */
let endsDrawing = false;

export function followPointer(map: OlMap): void {
  map.getViewport()?.addEventListener("pointerdown", () => (endsDrawing = false), { capture: true });
  map.on("click", (event) => {
    if (endsDrawing) return;
    const here = ground.peek();
    const place = rounded(event.coordinate);
    if (!here || overview.peek() || !contains(here.extent, place) || SHAPES.has(tool.peek())) return;
    if (PLACES.has(tool.peek())) {
      use(place);
      return;
    }
    const [hit] = map.getFeaturesAtPixel(event.pixel, { layerFilter: (one) => CLICKED.includes(one), hitTolerance: 4 });
    if (hit?.get("ghost") !== undefined) acceptGhost(String(hit.get("ghost")));
    else if (hit?.get("way") !== undefined) wayShown.value = Number(hit.get("way"));
    else if (hit) selected.value = String((hit as Feature).getId());
    else use(place);
  });
  map.on("pointermove", (event) => {
    if (event.dragging) return;
    const over = map.hasFeatureAtPixel(event.pixel, { layerFilter: (one) => TOUCHED.includes(one), hitTolerance: 4 });
    const target = map.getTargetElement();
    if (target) target.style.cursor = over ? "grab" : tool.peek() === "look" ? "" : "crosshair";
  });
  drag(map);
  draw(map);
}

function use(place: Place): void {
  accept(mode.peek() === "air" ? "air" : "path");
  const { anchors, flight, route } = mission.peek();
  switch (tool.peek()) {
    case "anchor": {
      const anchor = newAnchor(anchors, place);
      change({ anchors: [...anchors, anchor] });
      selected.value = anchor.id;
      return;
    }
    case "start":
      change({ route: { ...route, start: place } });
      tool.value = route.goal ? "look" : "goal";
      return;
    case "goal":
      change({ route: { ...route, goal: place } });
      tool.value = "look";
      return;
    case "way-point":
      change({ route: { ...route, way_points: [...route.way_points, place] } });
      return;
    case "take-off":
      change({ flight: { ...flight, start: place } });
      tool.value = flight.goal ? "look" : "landing";
      return;
    case "landing":
      change({ flight: { ...flight, goal: place } });
      tool.value = "look";
      return;
    case "flight": {
      const chosen = anchors.find(({ id }) => id === selected.peek());
      if (chosen) change(withAnchor(chosen.id, { flies_to: [...chosen.flies_to, place] }));
      return;
    }
    default:
      pinned.value = place;
      if (mode.peek() !== "anchors") selected.value = null;
  }
}

function drag(map: OlMap): void {
  // with a tool in hand that sets a place, a press on an anchor sets it there
  const translate = new Translate({ layers: [anchorLayer, placeLayer], hitTolerance: 6, condition: () => !PLACES.has(tool.peek()) });
  const apply = (feature: Feature, how: typeof follow): void => {
    const geometry = feature.getGeometry();
    if (!(geometry instanceof Point)) return;
    const at = rounded(geometry.getCoordinates());
    const what = feature.get("place") as string | undefined;
    if (what === undefined) how(withAnchor(String(feature.getId()), at));
    else how(movedPlace(what, Number(feature.get("number")), at));
  };
  translate.on("translatestart", (event) => {
    const first = event.features.item(0);
    if (first.get("place") === undefined) selected.value = String(first.getId());
  });
  translate.on("translating", (event) => {
    const first = event.features.item(0);
    // markers of the path are drawn anew from the mission, which would take them out of the hand
    if (first.get("place") === undefined) apply(first, follow);
  });
  translate.on("translateend", (event) => {
    // who only clicks moves nothing, not even to a whole metre
    const [from, to] = [event.startCoordinate, event.coordinate];
    if (isFollowing() || from[0] !== to[0] || from[1] !== to[1]) apply(event.features.item(0), change);
  });
  map.addInteraction(translate);
}

function movedPlace(what: string, number: number, at: Place): Partial<Mission> {
  const { flight, route } = mission.peek();
  if (what === "start") return { route: { ...route, start: at } };
  if (what === "goal") return { route: { ...route, goal: at } };
  if (what === "take-off") return { flight: { ...flight, start: at } };
  if (what === "landing") return { flight: { ...flight, goal: at } };
  return { route: { ...route, way_points: route.way_points.map((one, index) => (index === number ? at : one)) } };
}

let drawing: Draw | null = null;

/** What Enter does: the tool in hand is used in the middle of the map; closes: what is drawn ends there. */
export function useInTheMiddle(map: OlMap, closes: boolean): void {
  const [here, middle] = [ground.peek(), map.getView().getCenter()];
  if (overview.peek()) {
    cornerInTheMiddle(map);
    return;
  }
  if (!here || !middle) return;
  const place = rounded(middle);
  if (!contains(here.extent, place)) return;
  if (!drawing) use(place);
  else {
    drawing.appendCoordinates([[place.east_m, place.north_m]]);
    if (closes) drawing.finishDrawing();
  }
}

function draw(map: OlMap): void {
  effect(() => {
    if (drawing) map.removeInteraction(drawing);
    drawing = null;
    const what = tool.value;
    if (!SHAPES.has(what)) return;
    // what is kept away from may be one place: two clicks on it
    drawing = what === "stand-off" ? new Draw({ type: "LineString", minPoints: 1 }) : new Draw({ type: "Polygon" });
    drawing.on("drawend", (event) => {
      const geometry = event.feature.getGeometry();
      const corners = geometry instanceof Polygon ? (geometry.getCoordinates()[0] ?? []).slice(0, -1) : (geometry as LineString).getCoordinates();
      endsDrawing = true;
      take(what, corners.map(rounded));
      tool.value = "look";
    });
    map.addInteraction(drawing);
  });
}

/** What was drawn becomes part of the mission. */
function take(what: Tool, places: Ring): void {
  const { route, rules } = mission.peek();
  if (what === "area") change({ area: places });
  else if (what === "no-go") change({ route: { ...route, no_go: [...route.no_go, places] } });
  else if (what === "keep-in") change({ route: { ...route, keep_in: [...route.keep_in, places] } });
  else if (what === "no-fly") change({ rules: { ...rules, no_fly: [...rules.no_fly, places] } });
  else if (what === "stand-off") {
    const apart = places.filter((one, at) => at === 0 || one.east_m !== places[at - 1]?.east_m || one.north_m !== places[at - 1]?.north_m);
    change({ rules: { ...rules, stand_off: [...rules.stand_off, { places: apart, distance_m: FIRST_STAND_OFF_M }] } });
  }
}
