// From what is looked at to a colour for each post, and to the legend that says what the colours mean.
import { NO_FIX, NONE, SEEN_COLOURS, SHARE_STEPS, SLOPE_STEPS, MARGIN_STEPS, type Step, UNKNOWN, countColour, limitSteps, signalSteps } from "./palettes";
import type { Air, AirColumns } from "../products/air";
import type { Dilution } from "../products/dilution";
import type { Margins } from "../products/margins";
import { NEVER_MM, type Surface, UNKNOWN_MM } from "../products/surfaces";
import type { Ground } from "../geo/grid";
import type { Sample } from "../geo/sample";
import type { Rules } from "../mission/mission";
import type { Overlay } from "../state";
import { figure, fixed, fromMetres, percent, unit } from "../units";
import { words } from "../words";

export interface Entry {
  readonly colour: number;
  readonly label: string;
}

export interface Painting {
  readonly title: string;
  /** Puts down for each place of a sample the number of its entry; NONE: nothing to say, UNKNOWN: not known. */
  readonly classify: (sample: Sample, kinds: Int16Array) => void;
  readonly entries: readonly Entry[];
}

export interface Looked {
  readonly overlay: Overlay;
  readonly ground: Ground;
  readonly surfaces: readonly Surface[];
  readonly chosen: Surface | null;
  readonly dilution: Dilution | null;
  /** Whether surfaces tell what is usable, not what is in sight. */
  readonly heard: boolean;
  readonly margins: Margins | null;
  readonly marginWantedDb: number;
  readonly air: Air | null;
  /** The morphing map of each time, and the one that is looked at. */
  readonly frames: readonly AirColumns[];
  readonly frame: AirColumns | null;
  readonly seen: Float32Array | null;
  readonly after: { readonly of: number; readonly count: Uint8Array; readonly heard: boolean } | null;
  readonly rules: Rules;
  /** Height above the ground of anchors that are sought, metres. */
  readonly soughtM: number;
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
    case "signal":
      return looked.heard && looked.margins ? signalPainting(looked, looked.margins) : null;
    case "dilution":
      return looked.dilution && dopPainting(looked, looked.dilution);
    case "error":
      return looked.dilution?.errorM ? errorPainting(looked, looked.dilution.errorM) : null;
    case "slope":
      return slopePainting(looked);
    case "permitted":
      return permittedPainting(looked);
    case "air":
      return looked.air && airPainting(looked, looked.air, words.overlay.air);
    case "sites":
      return looked.seen && sitesPainting(looked.seen);
    case "after":
      return looked.after && afterPainting(looked.after);
    case "ceiling":
      return ceilingPainting(looked);
    case "frame":
      return looked.frame && airPainting(looked, looked.frame, words.overlay.frame);
    case "available":
      return looked.frames.length > 0 ? availablePainting(looked, looked.frames) : null;
  }
}

function countPainting({ surfaces, receiverM, heard }: Looked): Painting {
  const entries = Array.from({ length: surfaces.length + 1 }, (_, count) => ({
    colour: countColour(count, surfaces.length),
    label: words.anchorsInSight(count),
  }));
  return { title: words.shows("count", heard), entries, classify: (sample, kinds) => countSeen(sample, kinds, surfaces, receiverM) };
}

/** How many are in sight of each place; UNKNOWN where nobody is and somebody may be. Without branches, so that it slides. */
function countSeen(sample: Sample, kinds: Int16Array, surfaces: readonly Surface[], receiverM: number): void {
  const beyondMm = Math.floor(receiverM * 1000) + 1;
  kinds.fill(0);
  for (const surface of surfaces) addSeen(sample.of(surface.neededMm), beyondMm, kinds);
  for (const { neededMm, someUnknown } of surfaces) {
    if (!someUnknown) continue;
    const needed = sample.of(neededMm);
    for (let at = 0; at < needed.length; at += 1) if (needed[at] === UNKNOWN_MM && (kinds[at] as number) <= 0) kinds[at] = UNKNOWN;
  }
}

/** One more where less than so much is needed: the sign of the difference. */
function addSeen(neededMm: Int32Array, beyondMm: number, kinds: Int16Array): void {
  for (let at = 0; at < neededMm.length; at += 1) kinds[at] = (kinds[at] as number) + (((neededMm[at] as number) - beyondMm) >>> 31);
}

function onePainting({ receiverM, heard }: Looked, surface: Surface): Painting {
  const entries = [
    { colour: countColour(0, 1), label: heard ? words.tooWeak : words.hidden },
    { colour: countColour(1, 1), label: heard ? words.usable : words.inSight },
  ];
  return { title: words.shows("one", heard), entries, classify: (sample, kinds) => countSeen(sample, kinds, [surface], receiverM) };
}

/** By how much the best placed anchor is in sight, or out of it; the same of its signal where that decides. */
function marginPainting({ surfaces, receiverM, heard }: Looked): Painting {
  const classify = (sample: Sample, kinds: Int16Array): void => {
    const needed = surfaces.map((surface) => sample.of(surface.neededMm));
    for (let at = 0; at < kinds.length; at += 1) {
      let least = UNKNOWN_MM;
      for (const neededMm of needed) least = Math.min(least, neededMm[at] as number);
      kinds[at] = least === UNKNOWN_MM ? UNKNOWN : stepOf(MARGIN_STEPS, least === NEVER_MM ? -Infinity : receiverM - least / 1000);
    }
  };
  const entries = entriesOf(MARGIN_STEPS, (value) => `${fixed(fromMetres(value), 0)} ${unit.value}`);
  return { title: words.shows("margin", heard), entries, classify };
}

/** What arrives of the best anchor beyond need, about the margin that is wanted. */
function signalPainting({ marginWantedDb }: Looked, { bestDb }: Margins): Painting {
  const steps = signalSteps(marginWantedDb);
  const classify = (sample: Sample, kinds: Int16Array): void => {
    const here = sample.of(bestDb);
    for (let at = 0; at < here.length; at += 1) kinds[at] = stepOf(steps, here[at] as number);
  };
  return { title: words.overlay.signal, entries: entriesOf(steps, (value) => `${fixed(value, 0)} dB`), classify };
}

function dopPainting({ dopLimit }: Looked, { dop, answer }: Dilution): Painting {
  return { title: words.dilutionOf(answer.measure, answer.on_surface), ...limited(dop, dopLimit, (value) => figure(value, 1)) };
}

function errorPainting({ errorLimitM }: Looked, errorM: Float32Array): Painting {
  const told = (value: number): string => `${figure(fromMetres(value))} ${unit.value}`;
  return { title: words.overlay.error, ...limited(errorM, errorLimitM, told) };
}

function limited(values: Float32Array, limit: number, told: (value: number) => string): Omit<Painting, "title"> {
  const steps = limitSteps(limit);
  const entries = [...entriesOf(steps, told), { colour: NO_FIX, label: words.noFix }];
  const classify = (sample: Sample, kinds: Int16Array): void => {
    const here = sample.of(values);
    for (let at = 0; at < here.length; at += 1) kinds[at] = here[at] === Infinity ? steps.length : stepOf(steps, here[at] as number);
  };
  return { entries, classify };
}

function slopePainting({ ground }: Looked): Painting {
  const classify = (sample: Sample, kinds: Int16Array): void => {
    const slopeDeg = sample.of(ground.slopeDeg);
    for (let at = 0; at < slopeDeg.length; at += 1) kinds[at] = stepOf(SLOPE_STEPS, slopeDeg[at] as number);
  };
  return { title: words.overlay.slope, entries: entriesOf(SLOPE_STEPS, (value) => `${value}°`), classify };
}

function permittedPainting({ ground, maxSlopeDeg }: Looked): Painting {
  const entries = [
    { colour: 0x5ab4ac, label: words.permitted(maxSlopeDeg) },
    { colour: 0xbf812d, label: words.tooSteep },
  ];
  const classify = (sample: Sample, kinds: Int16Array): void => {
    const slopeDeg = sample.of(ground.slopeDeg);
    for (let at = 0; at < slopeDeg.length; at += 1) {
      const slope = slopeDeg[at] as number;
      kinds[at] = Number.isNaN(slope) ? UNKNOWN : slope <= maxSlopeDeg ? 0 : 1;
    }
  };
  return { title: words.overlay.permitted, entries, classify };
}

/** Whether one may fly at a height above the ground, by the morphing map. */
function airPainting({ flownAboveGroundM }: Looked, columns: AirColumns, title: string): Painting {
  const entries = [
    { colour: 0x2c7bb6, label: words.flyableHere },
    { colour: 0xfdae61, label: words.flyableHigher },
    { colour: NO_FIX, label: words.flyableNowhere },
  ];
  return { title, entries, classify: (sample, kinds) => flyable(sample, kinds, columns, flownAboveGroundM) };
}

function flyable(sample: Sample, kinds: Int16Array, { state, aboveGroundM }: AirColumns, flownM: number): void {
  const [columns, lowest] = [sample.of(state), sample.of(aboveGroundM)];
  for (let at = 0; at < columns.length; at += 1) {
    const [column, from] = [columns[at] as number, lowest[at] as number];
    if (column === 255 || (Number.isNaN(from) && (column === 1 || column === 2))) kinds[at] = UNKNOWN;
    else if (column === 1) kinds[at] = 0;
    else if (column === 2) kinds[at] = flownM >= from ? 0 : 1;
    else kinds[at] = 2;
  }
}

/** In what share of the frames one may fly at a height above the ground; unknown where any of them is. */
function availablePainting({ flownAboveGroundM }: Looked, frames: readonly AirColumns[]): Painting {
  const classify = (sample: Sample, kinds: Int16Array): void => {
    const [now, times] = [new Int16Array(kinds.length), new Int16Array(kinds.length)];
    for (const one of frames) {
      flyable(sample, now, one, flownAboveGroundM);
      for (let at = 0; at < now.length; at += 1) times[at] = now[at] === UNKNOWN || times[at] === UNKNOWN ? UNKNOWN : (times[at] as number) + (now[at] === 0 ? 1 : 0);
    }
    for (let at = 0; at < kinds.length; at += 1) kinds[at] = times[at] === UNKNOWN ? UNKNOWN : stepOf(SHARE_STEPS, (times[at] as number) / frames.length);
  };
  const labels = [words.never, ...SHARE_STEPS.slice(1, -1).map(({ below }) => `< ${percent(below)}`), words.always];
  const entries = SHARE_STEPS.map(({ colour }, number) => ({ colour, label: labels[number] as string }));
  return { title: words.overlay.available, entries, classify };
}

/** How much of the ground each place would see, in fifths of the most that any sees. */
function sitesPainting(seen: Float32Array): Painting {
  const most = seen.reduce((best, share) => (share > best ? share : best), 0.001);
  const steps = SEEN_COLOURS.map((colour, number) => ({ colour, below: number === SEEN_COLOURS.length - 1 ? Infinity : ((number + 1) * most) / SEEN_COLOURS.length }));
  const classify = (sample: Sample, kinds: Int16Array): void => {
    const here = sample.of(seen);
    for (let at = 0; at < here.length; at += 1) kinds[at] = stepOf(steps, here[at] as number);
  };
  return { title: words.overlay.sites, entries: entriesOf(steps, percent), classify };
}

/** How many anchors would be in sight with all that were found. */
function afterPainting({ of, count, heard }: NonNullable<Looked["after"]>): Painting {
  const entries = Array.from({ length: of + 1 }, (_, number) => ({ colour: countColour(number, of), label: words.anchorsInSight(number) }));
  const classify = (sample: Sample, kinds: Int16Array): void => {
    const here = sample.of(count);
    for (let at = 0; at < here.length; at += 1) kinds[at] = here[at] === 255 ? UNKNOWN : (here[at] as number);
  };
  return { title: words.shows("after", heard), entries, classify };
}

/** Where the ceilings let an anchor be at the height that is sought. */
function ceilingPainting({ ground, rules, soughtM }: Looked): Painting {
  const entries = [
    { colour: 0x5ab4ac, label: words.belowCeiling },
    { colour: NO_FIX, label: words.aboveCeiling },
  ];
  const tooHigh = soughtM > (rules.max_above_ground_m ?? Infinity);
  const mostM = tooHigh ? -Infinity : (rules.max_altitude_m ?? Infinity) - soughtM;
  const classify = (sample: Sample, kinds: Int16Array): void => {
    const heightsM = sample.of(ground.heights.heightsM);
    for (let at = 0; at < heightsM.length; at += 1) {
      const height = heightsM[at] as number;
      kinds[at] = Number.isNaN(height) ? UNKNOWN : height <= mostM ? 0 : 1;
    }
  };
  return { title: words.overlay.ceiling, entries, classify };
}

/** The step that a value lies in; UNKNOWN for NaN. */
function stepOf(steps: readonly Step[], value: number): number {
  for (let number = 0; number < steps.length; number += 1) if (value < (steps[number] as Step).below) return number;
  return Number.isNaN(value) ? UNKNOWN : steps.length - 1;
}

function entriesOf(steps: readonly Step[], told: (value: number) => string): Entry[] {
  return steps.map(({ below, colour }, number) => {
    const from = steps[number - 1]?.below;
    if (from === undefined) return { colour, label: `< ${told(below)}` };
    return { colour, label: below === Infinity ? `≥ ${told(from)}` : `${told(from)} – ${told(below)}` };
  });
}

export { NONE, UNKNOWN };
