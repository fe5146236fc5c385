// Raster layers of finished calculations as arrays, at the level that the ground is held at: a large one is never sent whole.
import { askBytes, Refusal } from "../api/http";
import { layer } from "../api/jobs";
import type { Job } from "../api/types";
import { words } from "../words";
import type { Ground } from "./grid";

/** Bands of float32, each as long as the ground's kept posts. */
export async function floatsOf(job: Job<unknown>, name: string, here: Ground): Promise<readonly Float32Array[]> {
  const numbers = new Float32Array(await levelOf(job, name, here));
  return bandsOf(numbers, name, here);
}

/** The same of uint8. */
export async function bytesOf(job: Job<unknown>, name: string, here: Ground): Promise<readonly Uint8Array[]> {
  return bandsOf(new Uint8Array(await levelOf(job, name, here)), name, here);
}

async function levelOf(job: Job<unknown>, name: string, here: Ground): Promise<ArrayBuffer> {
  const tiles = layer(job, name).replace("/layers/", "/tiles/");
  return askBytes(`${tiles}/${here.heights.level}`);
}

function bandsOf<T extends Float32Array | Uint8Array>(numbers: T, name: string, here: Ground): readonly T[] {
  const posts = here.heights.heightsM.length;
  if (numbers.length === 0 || numbers.length % posts !== 0) throw new Refusal(words.heightsTorn(name), 0, "");
  return Array.from({ length: numbers.length / posts }, (_, band) => numbers.subarray(band * posts, (band + 1) * posts) as T);
}
