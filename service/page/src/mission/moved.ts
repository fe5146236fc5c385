// A mission on another ground: every place follows, and what has no place there is named.
import type { Place } from "../api/types";
import type { Buildings, Mission, Ring, Trees } from "./mission";

/** All places of a mission moved by one rule; what has no place any more is left out and named. */
export function moved(mission: Mission, move: (place: Place) => Place | null): { mission: Mission; lost: string[] } {
  const lost: string[] = [];
  const place = <T extends Place>(one: T, called: string): T | null => {
    const there = move(one);
    if (there === null) lost.push(called);
    return there === null ? null : { ...one, east_m: there.east_m, north_m: there.north_m };
  };
  const places = <T extends Place>(all: readonly T[], called: (one: T, number: number) => string): T[] =>
    all.map((one, number) => place(one, called(one, number))).filter((one) => one !== null);
  const ring = (corners: Ring, called: string): Ring | null => {
    const there = corners.map(move).filter((one) => one !== null);
    if (there.length === corners.length) return there;
    lost.push(called);
    return null;
  };
  const rings = (all: readonly Ring[], called: string): Ring[] =>
    all.map((one, number) => ring(one, `${called} ${number + 1}`)).filter((one) => one !== null);
  // in degrees they lie where they are on any ground
  const stayed = (buildings: Buildings): Buildings | null => {
    if (buildings.geojson["coordinates_are"] !== "metres") return buildings;
    lost.push("the buildings");
    return null;
  };
  // a raster is of its own ground
  const grown = (trees: Trees): Trees | null => {
    if (trees.what === "top") return trees;
    lost.push("the trees");
    return null;
  };
  const { flight, route, rules } = mission;
  return {
    mission: {
      ...mission,
      anchors: places(mission.anchors, (anchor) => anchor.id).map((anchor) => ({
        ...anchor,
        flies_to: places(anchor.flies_to, (_, number) => `${anchor.id}'s place ${number + 1}`),
      })),
      buildings: mission.buildings && stayed(mission.buildings),
      trees: mission.trees && grown(mission.trees),
      area: mission.area && ring(mission.area, "the area"),
      route: {
        ...route,
        start: route.start && place(route.start, "the start"),
        goal: route.goal && place(route.goal, "the goal"),
        way_points: places(route.way_points, (_, number) => `way-point ${number + 1}`),
        no_go: rings(route.no_go, "no-go area"),
        keep_in: rings(route.keep_in, "keep-in area"),
      },
      flight: {
        ...flight,
        start: flight.start && place(flight.start, "the take-off"),
        goal: flight.goal && place(flight.goal, "the end of the flight"),
      },
      rules: {
        ...rules,
        no_fly: rings(rules.no_fly, "no-fly area"),
        stand_off: rules.stand_off.flatMap((one, number) => {
          const there = ring(one.places, `stand-off ${number + 1}`);
          return there === null ? [] : [{ ...one, places: there }];
        }),
      },
    },
    lost,
  };
}
