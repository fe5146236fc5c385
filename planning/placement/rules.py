"""Where anchors may be put: what each rule takes away, and which may stand together."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from planning.errors import NoCandidateError, PlacementError
from terrain import ElevationGrid
from visibility import VISIBLE
from visibility.sight.roofs import roofs_over
from visibility.signal import Radio, reception

from .candidates import Candidates
from .targets import Targets

__all__ = [
    "Feasible",
    "Link",
    "PlacementRules",
    "base_hops",
    "candidates_within",
    "feasible_candidates",
    "linked_pairs",
]

Floats = npt.NDArray[np.float64]
FAR = 1_000_000  # hops of a place that has no link at all
LINES_AT_ONCE = 200_000
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Link:
    """What a link needs: a line of sight no longer than max_range_m.

    bases_m: (b, 3) as tuples: base stations or parent drones, east, north, altitude. relays: how many other anchors a
        link may go over; 0 = every anchor sees a base itself. radio: of both ends: its signal decides, in place of
        sight. Raises PlacementError.
    """

    bases_m: tuple[tuple[float, float, float], ...]
    max_range_m: float = math.inf
    relays: int = 0
    radio: Radio | None = None

    def __post_init__(self) -> None:
        if not self.bases_m or not np.isfinite(np.array(self.bases_m, np.float64)).all():
            raise PlacementError("A link needs at least one base with a finite position.")
        if not self.max_range_m > 0.0 or self.relays < 0:
            raise PlacementError(
                f"A link needs max_range_m > 0 and relays >= 0, not {self.max_range_m} and {self.relays}."
            )


def linked_pairs(grid: ElevationGrid, link: Link, one_m: Floats, other_m: Floats) -> npt.NDArray[np.bool_]:
    """(n, m) bool: whether places (n, 3) and (m, 3) have a link; over unknown ground there is none."""
    apart_m = np.sqrt(((one_m[:, None, :] - other_m[None, :, :]) ** 2).sum(axis=2))
    linked: npt.NDArray[np.bool_] = apart_m <= link.max_range_m
    first, second = np.nonzero(linked)
    for start in range(0, len(first), LINES_AT_ONCE):
        part = slice(start, start + LINES_AT_ONCE)
        got = reception(grid, one_m[first[part]], other_m[second[part]], link.radio)
        linked[first[part], second[part]] = got.verdict == VISIBLE
    return linked


def base_hops(grid: ElevationGrid, link: Link, places_m: Floats) -> npt.NDArray[np.int64]:
    """(n,) fewest hops from each place to a base when every other place may relay; FAR = none."""
    hops = np.full(len(places_m), FAR)
    reached = linked_pairs(grid, link, places_m, np.array(link.bases_m, np.float64)).any(axis=1)
    hops[reached] = 1
    for hop in range(2, link.relays + 2):
        last, open_ = np.flatnonzero(hops == hop - 1), np.flatnonzero(hops == FAR)
        if not len(last) or not len(open_):
            break
        for place in last:
            if not len(open_):
                break
            found = linked_pairs(grid, link, places_m[open_], places_m[[place]])[:, 0]
            hops[open_[found]] = hop
            open_ = open_[~found]
    return hops


@dataclass(frozen=True, slots=True)
class PlacementRules:
    """What a place for an anchor must keep to; lengths in metres, shapes in the grid's frame.

    no_fly: polygons that no anchor may be over. stand_off: shapes, each with the distance to keep from it.
    min_above_ground_m, max_above_ground_m, max_altitude_m: floor and ceilings.
    max_range_m: longest slant range that is measured; a place with no target in reach is no candidate.
    min_separation_m: between any two anchors, in space. link: what the radio link to a base needs.
    Raises PlacementError.
    """

    no_fly: tuple[shapely.Geometry, ...] = ()
    stand_off: tuple[tuple[shapely.Geometry, float], ...] = ()
    min_above_ground_m: float = 0.0
    max_above_ground_m: float = math.inf
    max_altitude_m: float = math.inf
    max_range_m: float = math.inf
    min_separation_m: float = 0.0
    link: Link | None = None

    def __post_init__(self) -> None:
        for name in ("min_above_ground_m", "min_separation_m"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise PlacementError(f"{name} must be a number of metres >= 0, not {getattr(self, name)}.")
        for name in ("max_above_ground_m", "max_range_m"):
            if not getattr(self, name) > 0.0:
                raise PlacementError(f"{name} must be > 0 m, not {getattr(self, name)}.")
        if math.isnan(self.max_altitude_m):
            raise PlacementError("max_altitude_m must be a number.")
        if self.min_above_ground_m > self.max_above_ground_m:
            raise PlacementError(
                f"The rules contradict each other: min_above_ground_m {self.min_above_ground_m:g} is above "
                f"max_above_ground_m {self.max_above_ground_m:g}."
            )
        for _, distance_m in self.stand_off:
            if not (math.isfinite(distance_m) and distance_m >= 0.0):
                raise PlacementError(f"A stand-off distance must be >= 0 m, not {distance_m}.")


@dataclass(frozen=True, slots=True, eq=False)
class Feasible:
    """Candidates that keep every rule. number: their numbers among those given. removed: how many each rule took."""

    candidates: Candidates
    number: npt.NDArray[np.intp]
    removed: dict[str, int]

    def sentence(self) -> str:
        """How many are left, and what took the others."""
        return _sentence(len(self.candidates), self.removed)


def feasible_candidates(
    grid: ElevationGrid, candidates: Candidates, rules: PlacementRules, targets: Targets
) -> Feasible:
    """The candidates that keep every rule, one rule after the other; what a rule took, the next does not count.

    Raises NoCandidateError when none is left.
    """
    number = np.arange(len(candidates))
    removed: dict[str, int] = {}
    for name, keeps in _rules(grid, rules, targets):
        kept = keeps(candidates.take(number))
        if not kept.all():
            removed[name] = int(np.count_nonzero(~kept))
            number = number[kept]
        if len(number) == 0:
            raise NoCandidateError(_sentence(0, removed), removed)
    return Feasible(candidates.take(number), number, removed)


def _rules(
    grid: ElevationGrid, rules: PlacementRules, targets: Targets
) -> list[tuple[str, Callable[[Candidates], Mask]]]:
    """Cheap rules first, each as (its name, which candidates keep it)."""
    found: list[tuple[str, Callable[[Candidates], Mask]]] = [
        ("no known ground below", lambda some: np.isfinite(some.ground_m) | _outside(grid, some)),
        ("below the ground", lambda some: ~(some.above_ground_m < 0.0)),
    ]
    if grid.standing is not None:
        found.append(("inside a building", lambda some: some.position_m[:, 2] >= _roofs(grid, some)))
    if rules.min_above_ground_m > 0.0:
        found.append(("too low above ground", lambda some: some.above_ground_m >= rules.min_above_ground_m - 1e-6))
    if math.isfinite(rules.max_above_ground_m):
        found.append(("too high above ground", lambda some: some.above_ground_m <= rules.max_above_ground_m + 1e-6))
    if math.isfinite(rules.max_altitude_m):
        found.append(("above the ceiling", lambda some: some.position_m[:, 2] <= rules.max_altitude_m + 1e-6))
    if rules.no_fly:
        zone = shapely.union_all(rules.no_fly)
        found.append(("in a no-fly zone", lambda some: ~_inside(zone, some)))
    for shape, distance_m in rules.stand_off:
        found.append(("within a stand-off distance", _keeps_off(shape, distance_m)))
    if math.isfinite(rules.max_range_m):
        found.append(("no target within range", lambda some: _reaches(some, targets, rules.max_range_m)))
    if rules.link is not None:
        link = rules.link
        found.append(("no link to a base", lambda some: base_hops(grid, link, some.position_m) <= link.relays + 1))
    return found


def _outside(grid: ElevationGrid, some: Candidates) -> Mask:
    """Beyond the DEM an altitude is taken as it is given; within it ground that is unknown may be anything."""
    west_m, south_m, east_m, north_m = grid.bounds_m
    east, north, altitude_m = some.position_m.T
    beyond: Mask = (east < west_m) | (east > east_m) | (north < south_m) | (north > north_m)
    known: Mask = beyond & np.isfinite(altitude_m)
    return known


def _roofs(grid: ElevationGrid, some: Candidates) -> Floats:
    return roofs_over(grid, some.position_m[:, 0], some.position_m[:, 1])


def _inside(zone: shapely.Geometry, some: Candidates) -> Mask:
    shapely.prepare(zone)
    inside: Mask = shapely.intersects_xy(zone, some.position_m[:, 0], some.position_m[:, 1])
    return inside


def _keeps_off(shape: shapely.Geometry, distance_m: float) -> Callable[[Candidates], Mask]:
    def keeps(some: Candidates) -> Mask:
        away_m = shapely.distance(shape, shapely.points(some.position_m[:, :2]))
        kept: Mask = away_m >= distance_m
        return kept

    return keeps


def _reaches(some: Candidates, targets: Targets, max_range_m: float) -> Mask:
    from scipy.spatial import KDTree

    nearest_m, _ = KDTree(targets.point_m).query(some.position_m, distance_upper_bound=max_range_m * (1.0 + 1e-9))
    reached: Mask = np.isfinite(nearest_m)
    return reached


def _sentence(left: int, removed: dict[str, int]) -> str:
    taken = ", ".join(f"{name}: {count:,}" for name, count in removed.items())
    if left == 0:
        return f"No place is left for an anchor; removed: {taken}."
    return f"{left:,} candidates" + (f"; removed: {taken}." if taken else "; no rule removed any.")


def candidates_within(
    grid: ElevationGrid,
    here_m: Floats,
    reach_m: float,
    above_ground_m: Sequence[float],
    altitudes_m: Sequence[float],
    every: int = 1,
) -> tuple[npt.NDArray[np.intp], Candidates]:
    """(posts (n,), candidates over them) of all posts within reach, at each height above ground and each altitude.

    here_m: (3,) east, north, altitude of a drone in the grid's frame; reach_m: metres over the ground. every: of the
    rows and columns every so many. Unknown ground gives NaN.
    """
    row, col = np.arange(grid.rows), np.arange(grid.cols)
    north_m, east_m = grid.origin_north_m - row * grid.cell_north_m, grid.origin_east_m + col * grid.cell_east_m
    near = np.add.outer((north_m - here_m[1]) ** 2, (east_m - here_m[0]) ** 2) <= reach_m**2
    near &= np.logical_and.outer(row % every == 0, col % every == 0)
    post = np.flatnonzero(near)
    ground_m = grid.heights_m.reshape(-1)[post].astype(np.float64)
    east, north = east_m[post % grid.cols], north_m[post // grid.cols]
    levels = [ground_m + height_m for height_m in above_ground_m]
    levels += [np.full(len(post), altitude_m) for altitude_m in altitudes_m]
    position_m = np.concatenate([np.column_stack([east, north, level]) for level in levels])
    candidates = Candidates(position_m, np.tile(ground_m, len(levels)), ("drone",) * len(position_m))
    return np.tile(post, len(levels)), candidates
