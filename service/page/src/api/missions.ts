// Missions that the service keeps, with their versions.
import { type Mission, missionOf } from "../mission/mission";
import { ask, askJson } from "./http";
import type { LayerLink } from "./types";

export interface Summary {
  readonly id: string;
  readonly name: string;
  readonly version: number;
  /** The DEM here that the mission's ground is, by its digest; null where it is not here. */
  readonly dem_id: string | null;
  readonly ground: string | null;
  readonly anchors: number;
  readonly saved_at: string;
  readonly saved_by: string | null;
}

export interface Version {
  readonly version: number;
  readonly name: string | null;
  readonly saved_at: string;
  readonly saved_by: string | null;
}

export interface Opened extends Summary {
  readonly told: readonly string[];
  readonly files: readonly LayerLink[];
  readonly mission: Mission;
}

const JSON_TYPE = { "Content-Type": "application/json" };

export function pathOf(id: string): string {
  return `/missions/${encodeURIComponent(id)}`;
}

async function opened(path: string, options: RequestInit = {}): Promise<Opened> {
  const told = await askJson<Opened>(path, options);
  return { ...told, mission: missionOf(told.mission) };
}

const by = (who: string): string => (who === "" ? "" : `?by=${encodeURIComponent(who)}`);

export function addMission(mission: Mission, who: string): Promise<Opened> {
  return opened(`/missions${by(who)}`, { method: "POST", headers: JSON_TYPE, body: JSON.stringify(mission) });
}

export function addMissionFile(file: File, who: string): Promise<Opened> {
  const body = new FormData();
  body.append("file", file);
  return opened(`/missions${by(who)}`, { method: "POST", body });
}

export function getMission(id: string, version?: number): Promise<Opened> {
  return opened(pathOf(id) + (version === undefined ? "" : `/versions/${version}`));
}

export function saveMission(id: string, mission: Mission, buildsOn: number, who: string): Promise<Summary> {
  const headers = { ...JSON_TYPE, "If-Match": `"${buildsOn}"` };
  return askJson<Summary>(pathOf(id) + by(who), { method: "PUT", headers, body: JSON.stringify(mission) });
}

export async function listMissions(): Promise<readonly Summary[]> {
  return (await askJson<{ missions: readonly Summary[] }>("/missions?limit=100")).missions;
}

export async function listVersions(id: string): Promise<readonly Version[]> {
  return (await askJson<{ versions: readonly Version[] }>(`${pathOf(id)}/versions?limit=100`)).versions;
}

export function nameVersion(id: string, version: number, name: string | null): Promise<Version> {
  const body = JSON.stringify({ name });
  return askJson<Version>(`${pathOf(id)}/versions/${version}/name`, { method: "PUT", headers: JSON_TYPE, body });
}

export async function removeMission(id: string): Promise<void> {
  await ask(pathOf(id), { method: "DELETE" });
}
