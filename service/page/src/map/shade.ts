// Draws ground and colours into the pixels of the screen: the cost is that of the window, however many posts there are.
import type { Ground } from "../geo/grid";
import { countedPosts, type Covered, type Sample } from "../geo/sample";
import { NONE, type Painting, UNKNOWN } from "./painters";

const STRIPE = 10;
const OPAQUE = 0xff000000;
const VOID_DARK = OPAQUE | 0x9a8f86;
const VOID_LIGHT = OPAQUE | 0xd8d2cc;
const CONTOUR = OPAQUE | 0x2a4a6a;
const HATCH = 0x55606a;
const LIGHTS = 256;

/** RGBA of the pixels on the ground, little-endian as ImageData has it; opacity: of the colours over the relief. */
export function shade(
  pixels: Uint32Array,
  { sample, width, left, top }: Covered,
  ground: Ground,
  painted: Painting | null,
  opacity: number,
  contourM: number,
): void {
  const lights = sample.of(ground.shade);
  const kinds = kindsOf(sample, painted);
  const colours = painted?.entries.map((entry) => entry.colour) ?? [];
  // rows of the table: unknown, nothing to say, then the classes
  const table = new Uint32Array((colours.length + 2) * LIGHTS);
  const hatch = new Uint32Array(LIGHTS);
  for (let light = 0; light < LIGHTS; light += 1) {
    const grey = OPAQUE | (light << 16) | (light << 8) | light;
    [table[light], table[LIGHTS + light]] = [grey, grey];
    colours.forEach((colour, kind) => (table[(kind + 2) * LIGHTS + light] = mixed(colour, light, opacity)));
    hatch[light] = mixed(HATCH, light, opacity);
  }
  for (let at = 0, x = 0, stripe = left + top; at < lights.length; at += 1) {
    const light = lights[at] as number;
    const kind = kinds[at] as number;
    if (light === 0) pixels[at] = stripe % STRIPE < 3 ? VOID_DARK : VOID_LIGHT;
    else pixels[at] = (kind === UNKNOWN && stripe % STRIPE < 3 ? hatch[light] : table[((kind + 2) << 8) | light]) as number;
    x += 1;
    stripe += 1;
    if (x === width) [x, stripe] = [0, stripe - width + 1];
  }
  if (contourM > 0) drawContours(pixels, width, sample.of(ground.heights.heightsM), contourM);
}

function kindsOf(sample: Sample, painted: Painting | null): Int16Array {
  const kinds = new Int16Array(sample.posts.length).fill(NONE);
  painted?.classify(sample, kinds);
  return kinds;
}

/** A pixel is on a line where the one before it, or the one above it, lies between other heights. */
function drawContours(pixels: Uint32Array, width: number, heightsM: Float32Array, contourM: number): void {
  const between = (at: number): number => Math.floor((heightsM[at] as number) / contourM);
  for (let at = 0; at < heightsM.length; at += 1) {
    const here = between(at);
    if (Number.isNaN(here)) continue;
    const [left, above] = [at % width > 0 ? between(at - 1) : here, at >= width ? between(at - width) : here];
    if ((left !== here && !Number.isNaN(left)) || (above !== here && !Number.isNaN(above))) pixels[at] = CONTOUR;
  }
}

function mixed(colour: number, light: number, opacity: number): number {
  const grey = light * (1 - opacity);
  const lit = (opacity * (105 + (150 * light) / 255)) / 255;
  const red = grey + ((colour >> 16) & 255) * lit;
  const green = grey + ((colour >> 8) & 255) * lit;
  const blue = grey + (colour & 255) * lit;
  return OPAQUE | (blue << 16) | (green << 8) | red;
}

/** Share of the known posts in each class of a painting, and of those where it is unknown. */
export function sharesOf(ground: Ground, painted: Painting): { shares: number[]; unknown: number } {
  const sample = countedPosts(ground);
  const lights = sample.of(ground.shade);
  const kinds = kindsOf(sample, painted);
  const counts = new Float64Array(painted.entries.length);
  let [known, unknown] = [0, 0];
  for (let at = 0; at < lights.length; at += 1) {
    if (lights[at] === 0) continue;
    known += 1;
    const kind = kinds[at] as number;
    if (kind === UNKNOWN) unknown += 1;
    else if (kind !== NONE) counts[kind] = (counts[kind] as number) + 1;
  }
  return { shares: Array.from(counts, (count) => count / Math.max(known, 1)), unknown: unknown / Math.max(known, 1) };
}
