// Metres, or feet for those who think in them; and how numbers are written.
import { effect, signal } from "@preact/signals";
import { store, stored } from "./stored";

export type LengthUnit = "m" | "ft";
const FEET_PER_M = 1 / 0.3048;
const KEY = "sightline.unit";

export const unit = signal<LengthUnit>(stored(KEY) === "ft" ? "ft" : "m");
effect(() => void store(KEY, unit.value));

export function fromMetres(metres: number): number {
  return unit.value === "ft" ? metres * FEET_PER_M : metres;
}

export function toMetres(value: number): number {
  return unit.value === "ft" ? value / FEET_PER_M : value;
}

/** A number as it is read, with a true minus; degrees keep the sign that other programs read. */
export function fixed(value: number, digits: number): string {
  return value.toFixed(digits).replace("-", "−");
}

/** A length with its unit: short ones to a tenth, long ones in kilometres or miles. */
export function length(metres: number | null | undefined, digits = 1): string {
  if (metres === null || metres === undefined || Number.isNaN(metres)) return "–";
  if (!Number.isFinite(metres)) return "∞";
  return `${fixed(fromMetres(metres), digits)} ${unit.value}`;
}

export function distance(metres: number): string {
  if (unit.value === "ft") return metres >= 1609 ? `${(metres / 1609.344).toFixed(2)} mi` : length(metres, 0);
  return metres >= 1000 ? `${(metres / 1000).toFixed(2)} km` : length(metres, 0);
}

export function percent(share: number | null | undefined): string {
  return share === null || share === undefined ? "–" : `${(100 * share).toFixed(1)} %`;
}

/** A probability; what rounding would make certain is told as more than that. Does not break across lines. */
export function probability(share: number): string {
  const [certain, told] = [share > 0.999, percent(Math.min(share, 0.999))];
  return `${certain ? "> " : ""}${told}`.replaceAll(" ", "\u00a0");
}

export function degrees(value: number, digits = 6): string {
  return `${value.toFixed(digits)}°`;
}

export function figure(value: number | null | undefined, digits = 2): string {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  return Number.isFinite(value) ? fixed(value, digits) : "no fix";
}

export function duration(seconds: number): string {
  if (seconds < 120) return `${seconds.toFixed(0)} s`;
  const minutes = Math.round(seconds / 60);
  return minutes < 120 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${String(minutes % 60).padStart(2, "0")} min`;
}
