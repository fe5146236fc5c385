// Places out of files of other programs, on a ground.
import { askJson } from "./http";
import type { RadioName } from "../mission/mission";
import type { Place } from "./types";

export interface ImportedPoint extends Place {
  readonly id: string;
  readonly what: string | null;
  readonly kind: string | null;
  readonly above_ground_m: number | null;
  readonly altitude_m: number | null;
  readonly max_range_m: number | null;
  readonly azimuth_from_deg: number | null;
  readonly azimuth_to_deg: number | null;
  readonly ranging_sigma_m: number | null;
  readonly radio: RadioName | null;
}

export interface ImportedLine {
  readonly id: string;
  readonly what: string | null;
  readonly places: readonly Place[];
}

export interface Imported {
  readonly format: string;
  readonly points: readonly ImportedPoint[];
  readonly lines: readonly ImportedLine[];
  readonly areas: readonly ImportedLine[];
  readonly told: readonly string[];
}

export function importPlaces(demId: string, file: File): Promise<Imported> {
  const body = new FormData();
  body.append("file", file);
  return askJson<Imported>(`/imports?dem_id=${encodeURIComponent(demId)}`, { method: "POST", body });
}
