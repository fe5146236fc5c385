// Grounds of the service.
import { words } from "../words";
import { askBytes, askJson, posted, Refusal } from "./http";
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

export interface Tile {
  readonly geometry: { readonly type: "Polygon" | "MultiPolygon"; readonly coordinates: readonly unknown[] };
  readonly properties: { readonly name: string; readonly cell_m: number };
}

/** Outlines of the operator's tiles in degrees, and the names of the sources that may be asked. */
export interface Coverage {
  readonly features: readonly Tile[];
  readonly sources: readonly string[];
}

export function groundCoverage(): Promise<Coverage> {
  return askJson<Coverage>("/ground");
}

interface GroundAsked {
  readonly area: Readonly<Record<string, number>>;
  readonly source?: string;
  readonly cell_m?: number;
}

interface UnderWay {
  readonly id: string;
  readonly status: "running" | "cancelled";
  readonly progress: number;
}

const WAIT_S = 1;
const AGAIN_MS = 500;

/** A DEM of an area, followed until it is made. */
export async function makeGroundOf(asked: GroundAsked, progress: (share: number) => void): Promise<Dem> {
  let told = await askJson<Dem | UnderWay>("/dems", posted(asked, WAIT_S));
  while ("status" in told) {
    if (told.status === "cancelled") throw new Refusal(words.cancelled, 0, "cancelled");
    progress(told.progress);
    await new Promise((resume) => setTimeout(resume, AGAIN_MS));
    told = await askJson<Dem | UnderWay>(`/dems/${encodeURIComponent(told.id)}`);
  }
  return told;
}

export interface ReadingOptions {
  readonly crs?: string;
  readonly height_unit?: string;
  readonly nodata?: string;
  readonly vertical_datum?: string;
  readonly cell_m?: string;
}

export function upload(file: File, options: ReadingOptions): Promise<Dem> {
  const given = new URLSearchParams(Object.entries(options).filter(([, value]) => value !== ""));
  const body = new FormData();
  body.append("file", file);
  return askJson<Dem>(`/dems?${given.toString()}`, { method: "POST", body });
}

/** Files that are tiles of one ground, joined by the service before they are warped. */
export function uploadTiles(files: readonly File[]): Promise<Dem> {
  const body = new FormData();
  for (const file of files) body.append("file", file);
  return askJson<Dem>("/dems", { method: "POST", body });
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
  const heightsM = new Float32Array(await askBytes(`/dems/${encodeURIComponent(dem.id)}/heights?level=${level}`));
  const step = 2 ** level;
  const [rows, cols] = [Math.ceil(dem.rows / step), Math.ceil(dem.cols / step)];
  if (heightsM.length !== rows * cols) throw new Refusal(words.heightsTorn(dem.name), 0, "");
  return { level, rows, cols, heightsM };
}
