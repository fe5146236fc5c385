// The path and the other ways beside it: which of them is looked at, and how one of them becomes the route.
import { computed, effect, signal } from "@preact/signals";
import type { PathAnswer, PathWay, Place } from "../api/types";
import type { Mission } from "../mission/mission";
import { change, mission } from "../state";
import { planned } from "./path";

export interface Way extends PathWay {
  /** 0: the path itself. */
  readonly number: number;
}

type Totals = NonNullable<PathAnswer["totals"]>;

/** Number of the way that is looked at. */
export const wayShown = signal(0);
/** The other ways of the path that was planned last. */
export const otherWays = computed<readonly Way[]>(() => numbered(planned.value?.answer.alternatives ?? []));
export const shownWay = computed<Way | null>(() => otherWays.value.find(({ number }) => number === wayShown.value) ?? null);
export const shownTotals = computed<Totals | null>(() => shownWay.value?.totals ?? planned.value?.answer.totals ?? null);

const numbered = (all: readonly PathWay[]): readonly Way[] => all.map((way, at) => ({ ...way, number: at + 1 }));

export function watchWays(): void {
  effect(() => {
    // other ways are of one path: a new one is looked at first
    if (planned.value || wayShown.peek() !== 0) wayShown.value = 0;
  });
}

/** The route through the corners of a way, so that what is planned next goes that way; no others are sought any more. */
export function routeAlong(route: Mission["route"], corners: readonly Place[]): Mission["route"] {
  const way_points = corners.slice(1, -1).map(({ east_m, north_m }) => ({ east_m, north_m }));
  return { ...route, way_points, alternatives: 0 };
}

export function takeWay({ corners }: Way): void {
  change({ route: routeAlong(mission.peek().route, corners) });
}

/** Leave at that time, and at no other. */
export function leaveAt(departureS: number): void {
  change({ route: { ...mission.peek().route, departure_s: departureS, leave_by_s: null, arrive_by_s: null } });
}
