// Grounds of the service.
import { words } from "../words";
import { ask, askJson, Refusal } from "./http";
import type { Dem } from "./types";

export const SAMPLES = ["jacksboro", "valley", "crater"] as const;
/** So many posts are drawn at once; larger grounds come as means of two by two or four by four. */
const MOST_POSTS = 5_000_000;

export async function listDems(): Promise<readonly Dem[]> {
  return (await askJson<{ dems: readonly Dem[] }>("/dems?limit=100")).dems;
}

export function getDem(id: string): Promise<Dem> {
  return askJson<Dem>(`/dems/${encodeURIComponent(id)}`);
}

export function takeSample(name: string): Promise<Dem> {
  return askJson<Dem>(`/dems?sample=${encodeURIComponent(name)}`, { method: "POST" });
}

/** How many tiles the operator's ground library has. */
export async function libraryTiles(): Promise<number> {
  return (await askJson<{ features: readonly unknown[] }>("/ground")).features.length;
}

export function fromLibrary(area: { lon_deg: number; lat_deg: number; radius_m: number }): Promise<Dem> {
  const headers = { "Content-Type": "application/json" };
  return askJson<Dem>("/dems", { method: "POST", headers, body: JSON.stringify({ area }) });
}

export interface ReadingOptions {
  readonly crs?: string;
  readonly height_unit?: string;
  readonly nodata?: string;
  readonly cell_m?: string;
}

export function upload(file: File, options: ReadingOptions): Promise<Dem> {
  const given = new URLSearchParams(Object.entries(options).filter(([, value]) => value !== ""));
  const body = new FormData();
  body.append("file", file);
  return askJson<Dem>(`/dems?${given.toString()}`, { method: "POST", body });
}

export interface Heights {
  /** Each value is the mean of 2^level by 2^level posts. */
  readonly level: number;
  readonly rows: number;
  readonly cols: number;
  readonly heightsM: Float32Array;
}

export async function heightsOf(dem: Dem): Promise<Heights> {
  let level = 0;
  while ((dem.rows >> level) * (dem.cols >> level) > MOST_POSTS) level += 1;
  const answer = await ask(`/dems/${encodeURIComponent(dem.id)}/heights?level=${level}`);
  const heightsM = new Float32Array(await answer.arrayBuffer());
  const step = 2 ** level;
  const [rows, cols] = [Math.ceil(dem.rows / step), Math.ceil(dem.cols / step)];
  if (heightsM.length !== rows * cols) throw new Refusal(words.heightsTorn(dem.name), 0, "");
  return { level, rows, cols, heightsM };
}
