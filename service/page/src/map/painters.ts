// From what is looked at to a colour for each post, and to the legend that says what the colours mean.
import { NO_FIX, NONE, SLOPE_STEPS, MARGIN_STEPS, type Step, UNKNOWN, countColour, limitSteps, stepColour } from "./palettes";
import type { Air } from "../products/air";
import type { Dilution } from "../products/dilution";
import type { Surface } from "../products/surfaces";
import { type Ground, postAt } from "../geo/grid";
import type { Overlay } from "../state";
import { figure, fromMetres, unit } from "../units";
import { words } from "../words";

export interface Entry {
  readonly colour: number;
  readonly label: string;
}

export interface Painting {
  readonly title: string;
  /** Number of the entry that a post belongs to; NONE: nothing to say, UNKNOWN: not known. */
  readonly classAt: (row: number, col: number) => number;
  readonly entries: readonly Entry[];
}

export interface Looked {
  readonly overlay: Overlay;
  readonly ground: Ground;
  readonly surfaces: readonly Surface[];
  readonly chosen: Surface | null;
  readonly dilution: Dilution | null;
  readonly air: Air | null;
  readonly receiverM: number;
  readonly dopLimit: number;
  readonly errorLimitM: number;
  readonly maxSlopeDeg: number;
  readonly flownAboveGroundM: number;
}

export function painting(looked: Looked): Painting | null {
  switch (looked.overlay) {
    case "none":
      return null;
    case "count":
      return looked.surfaces.length > 0 ? countPainting(looked) : null;
    case "one":
      return looked.chosen && onePainting(looked, looked.chosen);
    case "margin":
      return looked.surfaces.length > 0 ? marginPainting(looked) : null;
    case "dilution":
      return looked.dilution && dopPainting(looked, looked.dilution);
    case "error":
      return looked.dilution?.errorM ? errorPainting(looked, looked.dilution.errorM) : null;
    case "slope":
      return slopePainting(looked);
    case "permitted":
      return permittedPainting(looked);
    case "air":
      return looked.air && airPainting(looked, looked.air);
  }
}

/** 1 in sight, 0 hidden, NaN unknown; heights rounded to float32 as the service has them give the service's verdict. */
export function seenAt(surface: Surface, index: number, receiverAltitudeM: number): number {
  const least = surface.altitudeM[index] as number;
  if (surface.seen?.[index] === 0) return 0;
  if (Number.isNaN(least) || Number.isNaN(receiverAltitudeM)) return NaN;
  return receiverAltitudeM >= least ? 1 : 0;
}

function countPainting({ ground, surfaces, receiverM }: Looked): Painting {
  const { heightsM } = ground.heights;
  const { cols } = ground.dem;
  const entries = Array.from({ length: surfaces.length + 1 }, (_, count) => ({
    colour: countColour(count, surfaces.length),
    label: words.anchorsInSight(count),
  }));
  const classAt = (row: number, col: number): number => {
    const receiver = Math.fround((heightsM[postAt(ground, row, col)] as number) + receiverM);
    const index = row * cols + col;
    let [seen, unknown] = [0, 0];
    for (const surface of surfaces) {
      const verdict = seenAt(surface, index, receiver);
      if (verdict === 1) seen += 1;
      else if (verdict !== 0) unknown += 1;
    }
    return seen === 0 && unknown > 0 ? UNKNOWN : seen;
  };
  return { title: words.overlay.count, entries, classAt };
}

function onePainting({ ground, receiverM }: Looked, surface: Surface): Painting {
  const { heightsM } = ground.heights;
  const entries = [
    { colour: countColour(0, 1), label: words.hidden },
    { colour: countColour(1, 1), label: words.inSight },
  ];
  const classAt = (row: number, col: number): number => {
    const receiver = Math.fround((heightsM[postAt(ground, row, col)] as number) + receiverM);
    const seen = seenAt(surface, row * ground.dem.cols + col, receiver);
    return Number.isNaN(seen) ? UNKNOWN : seen;
  };
  return { title: words.overlay.one, entries, classAt };
}

/** By how much the best placed anchor is in sight, or out of it. */
function marginPainting({ ground, surfaces, receiverM }: Looked): Painting {
  const { heightsM } = ground.heights;
  return {
    title: words.overlay.margin,
    entries: entriesOf(MARGIN_STEPS, (value) => `${fromMetres(value).toFixed(0)} ${unit.value}`),
    classAt: (row, col) => {
      const receiver = Math.fround((heightsM[postAt(ground, row, col)] as number) + receiverM);
      const index = row * ground.dem.cols + col;
      let best = NaN;
      for (const surface of surfaces) {
        const margin = receiver - (surface.altitudeM[index] as number);
        if (!(margin <= best)) best = Number.isNaN(margin) ? best : margin;
      }
      return Number.isNaN(best) ? UNKNOWN : stepOf(MARGIN_STEPS, best);
    },
  };
}

function dopPainting({ ground, dopLimit }: Looked, { dop, answer }: Dilution): Painting {
  return { title: answer.measure.toUpperCase(), ...limited(ground, dop, dopLimit, (value) => figure(value, 1)) };
}

function errorPainting({ ground, errorLimitM }: Looked, errorM: Float32Array): Painting {
  const told = (value: number): string => `${figure(fromMetres(value))} ${unit.value}`;
  return { title: words.overlay.error, ...limited(ground, errorM, errorLimitM, told) };
}

function limited(
  ground: Ground,
  values: Float32Array,
  limit: number,
  told: (value: number) => string,
): Omit<Painting, "title"> {
  const steps = limitSteps(limit);
  const entries = [...entriesOf(steps, told), { colour: NO_FIX, label: words.noFix }];
  const classAt = (row: number, col: number): number => {
    const value = values[row * ground.dem.cols + col] as number;
    if (Number.isNaN(value)) return UNKNOWN;
    return value === Infinity ? steps.length : stepOf(steps, value);
  };
  return { entries, classAt };
}

function slopePainting({ ground }: Looked): Painting {
  const classAt = (row: number, col: number): number => {
    const slope = ground.slopeDeg[postAt(ground, row, col)] as number;
    return Number.isNaN(slope) ? UNKNOWN : stepOf(SLOPE_STEPS, slope);
  };
  return { title: words.overlay.slope, entries: entriesOf(SLOPE_STEPS, (value) => `${value}°`), classAt };
}

function permittedPainting({ ground, maxSlopeDeg }: Looked): Painting {
  const entries = [
    { colour: 0x5ab4ac, label: words.permitted(maxSlopeDeg) },
    { colour: 0xbf812d, label: words.tooSteep },
  ];
  const classAt = (row: number, col: number): number => {
    const slope = ground.slopeDeg[postAt(ground, row, col)] as number;
    return Number.isNaN(slope) ? UNKNOWN : slope <= maxSlopeDeg ? 0 : 1;
  };
  return { title: words.overlay.permitted, entries, classAt };
}

/** Whether one may fly at a height above the ground, by the morphing map. */
function airPainting({ ground, flownAboveGroundM }: Looked, { aboveGroundM, state }: Air): Painting {
  const entries = [
    { colour: 0x2c7bb6, label: words.flyableHere },
    { colour: 0xfdae61, label: words.flyableHigher },
    { colour: NO_FIX, label: words.flyableNowhere },
  ];
  const classAt = (row: number, col: number): number => {
    const index = row * ground.dem.cols + col;
    const [column, from] = [state[index] as number, aboveGroundM[index] as number];
    if (column === 255 || (Number.isNaN(from) && (column === 1 || column === 2))) return UNKNOWN;
    if (column === 1) return 0;
    if (column === 2) return flownAboveGroundM >= from ? 0 : 1;
    return 2;
  };
  return { title: words.overlay.air, entries, classAt };
}

function stepOf(steps: readonly Step[], value: number): number {
  for (let number = 0; number < steps.length; number += 1) if (value < (steps[number] as Step).below) return number;
  return steps.length - 1;
}

function entriesOf(steps: readonly Step[], told: (value: number) => string): Entry[] {
  return steps.map(({ below, colour }, number) => {
    const from = steps[number - 1]?.below;
    if (from === undefined) return { colour, label: `< ${told(below)}` };
    return { colour, label: below === Infinity ? `≥ ${told(from)}` : `${told(from)} – ${told(below)}` };
  });
}

export { NONE, UNKNOWN, stepColour };
