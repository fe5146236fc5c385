// Colours that those who see fewer colours can tell apart (light yellow to dark blue; blue against orange), as 0xRRGGBB.

export const NONE = -1;
export const UNKNOWN = -2;

const IN_SIGHT = [0xffffd9, 0xedf8b1, 0xc7e9b4, 0x7fcdbb, 0x41b6c4, 0x1d91c0, 0x225ea8, 0x253494, 0x081d58];
const NOBODY = 0xa87a5f;
export const NO_FIX = 0x6b1d1d;
const WITHIN = [0x2166ac, 0x67a9cf, 0xb8d8ea];
const BEYOND = [0xfdc98a, 0xf08a3c];

/** How many anchors are in sight: none is brown, then from light to dark, evenly spread over so many. */
export function countColour(count: number, anchors: number): number {
  if (count === 0) return NOBODY;
  const share = anchors <= 1 ? 0.5 : (count - 1) / (anchors - 1);
  return IN_SIGHT[Math.round(1 + share * (IN_SIGHT.length - 2))] as number;
}

export interface Step {
  readonly below: number;
  readonly colour: number;
}

/** Steps of a number that shall stay below a limit: blue within it, orange beyond. */
export function limitSteps(limit: number): Step[] {
  const at = [limit / 3, (2 * limit) / 3, limit];
  return [
    ...at.map((below, number) => ({ below, colour: WITHIN[number] as number })),
    { below: 2 * limit, colour: BEYOND[0] as number },
    { below: Infinity, colour: BEYOND[1] as number },
  ];
}

export const MARGIN_STEPS: readonly Step[] = [
  { below: -20, colour: 0x8c510a },
  { below: -5, colour: 0xbf812d },
  { below: 0, colour: 0xdfc27d },
  { below: 5, colour: 0xc7eae5 },
  { below: 20, colour: 0x5ab4ac },
  { below: Infinity, colour: 0x01665e },
];

/** Steps of a signal's margin, dB, about the one that is wanted: brown below it, green beyond. */
export function signalSteps(wantedDb: number): Step[] {
  const offsets = [-20, -10, 0, 10, 20, Infinity];
  return MARGIN_STEPS.map(({ colour }, number) => ({ below: wantedDb + (offsets[number] as number), colour }));
}

export const SLOPE_STEPS: readonly Step[] = [
  { below: 5, colour: 0xf7fbff },
  { below: 10, colour: 0xc6dbef },
  { below: 15, colour: 0x9ecae1 },
  { below: 20, colour: 0x6baed6 },
  { below: 25, colour: 0x3182bd },
  { below: 35, colour: 0x08519c },
  { below: Infinity, colour: 0x08203f },
];

/** Share of the time, 0..1: never, then from light to dark, always. */
export const SHARE_STEPS: readonly Step[] = [
  { below: 1e-9, colour: NOBODY },
  { below: 0.5, colour: 0xc7e9b4 },
  { below: 0.9, colour: 0x41b6c4 },
  { below: 1, colour: 0x225ea8 },
  { below: Infinity, colour: 0x081d58 },
];

/** How much of the ground a place sees: from dark to light, as heat is drawn. */
export const SEEN_COLOURS = [0x440154, 0x3b528b, 0x21918c, 0x5ec962, 0xfde725] as const;

export function stepColour(steps: readonly Step[], value: number): number {
  for (const step of steps) if (value < step.below) return step.colour;
  return NO_FIX;
}

export function css(colour: number): string {
  return `#${colour.toString(16).padStart(6, "0")}`;
}
