// How shapes are drawn: form tells kinds apart as well as colour does.
import CircleStyle from "ol/style/Circle.js";
import Fill from "ol/style/Fill.js";
import RegularShape from "ol/style/RegularShape.js";
import Stroke from "ol/style/Stroke.js";
import Style from "ol/style/Style.js";
import Text from "ol/style/Text.js";
import type { Kind } from "../mission/mission";
import type { Verdict } from "../products/readout";

const INK = "#1b1b1b";
const PAPER = "#ffffff";

function label(text: string, offsetY = -20): Text {
  return new Text({
    text,
    offsetY,
    font: "600 13px system-ui, sans-serif",
    fill: new Fill({ color: INK }),
    stroke: new Stroke({ color: PAPER, width: 3.5 }),
  });
}

export function markStyle(id: string, kind: Kind, chosen: boolean): Style {
  const fill = new Fill({ color: chosen ? "#ffb000" : "#ffe08a" });
  const stroke = new Stroke({ color: INK, width: chosen ? 3 : 1.6 });
  const radius = chosen ? 12 : 10;
  const shapes: Record<Kind, () => RegularShape> = {
    drone: () => new RegularShape({ points: 3, radius: radius + 2, fill, stroke }),
    mast: () => new RegularShape({ points: 4, radius: radius + 1, angle: Math.PI / 4, fill, stroke }),
    beacon: () => new CircleStyle({ radius: radius - 2, fill, stroke }),
  };
  return new Style({ image: shapes[kind](), text: label(id) });
}

const PINS: Readonly<Record<string, { readonly colour: string; readonly points: number }>> = {
  start: { colour: "#2c7bb6", points: 32 },
  goal: { colour: "#d7191c", points: 32 },
  "way-point": { colour: "#7b3294", points: 32 },
  "take-off": { colour: "#6a3d9a", points: 3 },
  landing: { colour: "#6a3d9a", points: 4 },
  blocked: { colour: "#000000", points: 4 },
  marked: { colour: "#0072b2", points: 32 },
  pin: { colour: "#ff00aa", points: 4 },
  rover: { colour: "#1b1b1b", points: 32 },
};

/** Places have their name below them, anchors above: both are read where one is at the other. */
export function pinStyle(what: string, text: string): Style {
  const { colour, points } = PINS[what] ?? { colour: INK, points: 32 };
  const stroke = new Stroke({ color: PAPER, width: 2.5 });
  const image =
    what === "blocked"
      ? new RegularShape({ points: 4, radius: 12, radius2: 3, angle: Math.PI / 4, fill: new Fill({ color: colour }), stroke })
      : new RegularShape({ points, radius: 8, fill: new Fill({ color: colour }), stroke });
  return new Style({ image, ...(text ? { text: label(text, 19) } : {}) });
}

const AREAS: Readonly<Record<string, { readonly stroke: string; readonly fill: string; readonly dash?: number[] }>> = {
  area: { stroke: "#ffffff", fill: "rgba(0,0,0,0)", dash: [10, 6] },
  "no-go": { stroke: "#b2182b", fill: "rgba(178,24,43,0.28)" },
  "no-fly": { stroke: "#6a3d9a", fill: "rgba(106,61,154,0.25)", dash: [3, 5] },
  "keep-in": { stroke: "#2166ac", fill: "rgba(0,0,0,0)", dash: [2, 5] },
};

export function areaStyle(what: string): Style[] {
  const { stroke, fill, dash } = AREAS[what] ?? { stroke: INK, fill: "rgba(0,0,0,0)" };
  const line = new Stroke({ color: stroke, width: 2.5, ...(dash ? { lineDash: dash } : {}) });
  const under = new Style({ stroke: new Stroke({ color: "rgba(0,0,0,0.6)", width: 4.5 }) });
  return [under, new Style({ stroke: line, fill: new Fill({ color: fill }) })];
}

export function buildingStyle(): Style {
  return new Style({ stroke: new Stroke({ color: "#ffffff", width: 1 }), fill: new Fill({ color: "rgba(58,58,66,0.85)" }) });
}

/** A place or a line, and the ground round it that is kept free; distanceM on both sides. */
export function standOffStyle(distanceM: number): (feature: unknown, resolution: number) => Style[] {
  return (_, resolution) => {
    const width = Math.max(4, (2 * distanceM) / resolution);
    const wide = { color: "rgba(106,61,154,0.25)", width, lineCap: "round", lineJoin: "round" } as const;
    const dot = new CircleStyle({ radius: width / 2, fill: new Fill({ color: wide.color }) });
    return [new Style({ stroke: new Stroke(wide), image: dot }), new Style({ stroke: new Stroke({ color: "#6a3d9a", width: 2.5 }) })];
  };
}

export function tileStyle(name: string): Style {
  const text = new Text({ text: name, font: "12px system-ui, sans-serif", overflow: false, fill: new Fill({ color: INK }), stroke: new Stroke({ color: PAPER, width: 3 }) });
  return new Style({ stroke: new Stroke({ color: "#0b5cad", width: 1.6 }), fill: new Fill({ color: "rgba(146,197,222,0.45)" }), text });
}

export function pathStyle(colour: string): Style[] {
  return [
    new Style({ stroke: new Stroke({ color: PAPER, width: 10 }) }),
    new Style({ stroke: new Stroke({ color: INK, width: 7.5 }), zIndex: 1 }),
    new Style({ stroke: new Stroke({ color: colour, width: 4.5 }), zIndex: 2 }),
  ];
}

/** Another way beside the path, by its number; thick where it is looked at. */
export function wayStyle(number: number, shown: boolean): Style[] {
  const width = shown ? 5 : 3;
  return [
    new Style({ stroke: new Stroke({ color: PAPER, width: width + 3 }) }),
    new Style({ stroke: new Stroke({ color: shown ? "#0b5cad" : "#5a4fcf", width, ...(shown ? {} : { lineDash: [10, 7] }) }), zIndex: 1 }),
    new Style({ text: new Text({ text: String(number), placement: "line", font: "700 14px system-ui, sans-serif", fill: new Fill({ color: INK }), stroke: new Stroke({ color: PAPER, width: 4 }) }), zIndex: 2 }),
  ];
}

/** Where an anchor flies along. */
export function flightStyle(): Style[] {
  return [
    new Style({ stroke: new Stroke({ color: PAPER, width: 4 }) }),
    new Style({ stroke: new Stroke({ color: INK, width: 2, lineDash: [8, 6] }) }),
  ];
}

/** Where a drone is to fly. */
export function flownStyle(): Style[] {
  return [
    new Style({ stroke: new Stroke({ color: PAPER, width: 6 }) }),
    new Style({ stroke: new Stroke({ color: "#6a3d9a", width: 3 }), zIndex: 1 }),
  ];
}

/** Something that is not placed there: offered, or there for a moment. */
export function ghostStyle(text: string): Style {
  const image = new RegularShape({
    points: 3,
    radius: 13,
    fill: new Fill({ color: "rgba(255,255,255,0.55)" }),
    stroke: new Stroke({ color: INK, width: 2, lineDash: [3, 3] }),
  });
  return new Style({ image, text: label(text) });
}

const SIGHT: Readonly<Record<Verdict, { readonly color: string; readonly lineDash?: number[] }>> = {
  seen: { color: "#00e08a" },
  hidden: { color: "#ff4d3d", lineDash: [8, 6] },
  unknown: { color: "#dddddd", lineDash: [2, 6] },
};

export function lineStyle(verdict: Verdict): Style[] {
  const { color, lineDash } = SIGHT[verdict];
  return [
    new Style({ stroke: new Stroke({ color: "rgba(0,0,0,0.55)", width: 3.5 }) }),
    new Style({ stroke: new Stroke({ color, width: 2, ...(lineDash ? { lineDash } : {}) }) }),
  ];
}

type Measured = "clear" | "occluded" | "too short" | "unknown";
const MEASURED: Readonly<Record<Measured, string>> = { clear: "#00e08a", occluded: "#ff4d3d", "too short": "#ffb000", unknown: "#dddddd" };

/** A range as a ring round its anchor. */
export function ringStyle(sight: Measured): Style {
  return new Style({ stroke: new Stroke({ color: MEASURED[sight], width: 1.5, ...(sight === "clear" ? {} : { lineDash: [6, 5] }) }) });
}

/** The line to an anchor: its colour is what was measured, dashes are what the map foretold as hidden. */
export function measuredStyle(sight: Measured, foretold: number | null): Style[] {
  const hidden = foretold !== null && foretold < 0.5;
  return [
    new Style({ stroke: new Stroke({ color: "rgba(0,0,0,0.55)", width: 4 }) }),
    new Style({ stroke: new Stroke({ color: MEASURED[sight], width: 2.4, ...(hidden ? { lineDash: [10, 8] } : {}) }) }),
  ];
}

export function trailStyle(): Style[] {
  return [new Style({ stroke: new Stroke({ color: PAPER, width: 5 }) }), new Style({ stroke: new Stroke({ color: "#0b5cad", width: 2.6 }) })];
}

/** A stretch ahead with too few anchors. */
export function aheadStyle(): Style[] {
  return [new Style({ stroke: new Stroke({ color: PAPER, width: 13 }) }), new Style({ stroke: new Stroke({ color: "#b2182b", width: 9, lineDash: [3, 10] }) })];
}

/** Where the path leads through what no rover is on. */
export function obstructedStyle(): Style[] {
  return [new Style({ stroke: new Stroke({ color: PAPER, width: 13 }) }), new Style({ stroke: new Stroke({ color: INK, width: 9, lineDash: [2, 6], lineCap: "butt" }) })];
}

/** Where the ranges of an anchor contradicted the map: along the drive, and thin towards the anchor. */
export function doubtStyle(text: string): Style[] {
  const image = new CircleStyle({ radius: 7, stroke: new Stroke({ color: "#aa3377", width: 3 }), fill: new Fill({ color: PAPER }) });
  return [new Style({ stroke: new Stroke({ color: PAPER, width: 10 }), zIndex: 1 }), new Style({ stroke: new Stroke({ color: "#aa3377", width: 6 }), image, text: label(`${text}?`, -18), zIndex: 2 })];
}

export function doubtLineStyle(): Style {
  return new Style({ stroke: new Stroke({ color: "#aa3377", width: 1.5, lineDash: [1, 5] }) });
}

export function ellipseStyle(): Style {
  return new Style({ stroke: new Stroke({ color: INK, width: 1.6 }), fill: new Fill({ color: "rgba(255,255,255,0.45)" }) });
}
