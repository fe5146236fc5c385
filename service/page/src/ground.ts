// Taking a ground under the mission: what has a place on it stays, what has none is named.
import { batch, effect } from "@preact/signals";
import { getDem, heightsOf } from "./api/dems";
import type { Dem, Place } from "./api/types";
import { frameOf } from "./geo/frames";
import { contains, extentOf, makeGround } from "./geo/grid";
import type { GroundRef, Mission } from "./mission/mission";
import { moved } from "./mission/moved";
import { air } from "./products/air";
import { frames } from "./products/frames";
import { flight } from "./products/flight";
import { forgetPath } from "./products/path";
import { dismissGhosts } from "./products/placement";
import { sites } from "./products/sites";
import { attempt, busy, change, cursor, ground, mission, notice, open, overlay, pinned, setBusy, tool } from "./state";
import { words } from "./words";

let turn = 0;
let awaited: { readonly sha256: string; readonly then: () => Promise<void> } | null = null;

/** A mission waits for a ground that the service does not have; once it is taken, the mission opens on it. */
export function waitFor(ground: GroundRef, then: () => Promise<void>): void {
  awaited = { sha256: ground.sha256, then };
}

/** opened: a mission to open on it; opening: told the mission as it will be, just before. */
export async function takeGround(request: Promise<Dem>, opened?: Mission, opening?: (document: Mission) => void): Promise<void> {
  turn += 1;
  const mine = turn;
  setBusy("ground", null);
  try {
    const dem = await request;
    if (awaited?.sha256 === dem.sha256) {
      const { then } = awaited;
      awaited = null;
      await then();
      return;
    }
    const heights = await heightsOf(dem);
    if (mine !== turn) return;
    const before = ground.peek()?.dem ?? null;
    const next = opened ?? mission.peek();
    const reference = { dem_id: dem.id, name: dem.name, sha256: dem.sha256 };
    const same = next.ground === null || next.ground.sha256 === dem.sha256;
    const { mission: kept, lost } = same ? { mission: next, lost: [] } : moved(next, carriedOver(before, dem));
    [cursor.value, pinned.value, air.value, frames.value, sites.value, flight.value] = [null, null, null, null, null, null];
    forgetPath();
    dismissGhosts();
    const here = makeGround(dem, heights);
    batch(() => {
      ground.value = here;
      const document = { ...kept, ground: reference };
      if (opened) {
        opening?.(document);
        open(document);
      } else change(document);
    });
    tool.value = "look";
    if (["air", "frame", "available", "sites"].includes(overlay.peek())) overlay.value = "none";
    notice.value = lost.length > 0 ? words.lostOnNewGround(lost) : "";
  } finally {
    if (mine === turn) setBusy("ground", undefined);
  }
}

/** Undo and redo may lead back to a mission on another ground, which is then taken again under it. */
export function followGround(): void {
  effect(() => {
    const asked = mission.value.ground?.dem_id;
    const here = ground.peek()?.dem.id;
    if (asked === here || "ground" in busy.peek()) return;
    if (asked === undefined) {
      ground.value = null;
      return;
    }
    // the page that has just opened takes the ground of its mission by itself
    if (here === undefined) return;
    void attempt("ground", async () => {
      setBusy("ground", null);
      try {
        const dem = await getDem(asked);
        const heights = await heightsOf(dem);
        [cursor.value, pinned.value, air.value, frames.value, sites.value, notice.value] = [null, null, null, null, null, ""];
        ground.value = makeGround(dem, heights);
      } finally {
        setBusy("ground", undefined);
      }
    });
  });
}

/** By degrees where both grounds lie on one body; else by the metres as they are; null beyond the new ground. */
function carriedOver(before: Dem | null, after: Dem): (place: Place) => Place | null {
  const extent = extentOf(after);
  const within = (place: Place | null): Place | null => (place && contains(extent, place) ? place : null);
  if (before === null || before.crs === after.crs) return within;
  if (before.body === null || before.body !== after.body) return () => null;
  const [from, to] = [frameOf(before), frameOf(after)];
  return (place) => {
    const degrees = from.toDegrees(place);
    return within(degrees && to.toMetres(degrees));
  };
}
