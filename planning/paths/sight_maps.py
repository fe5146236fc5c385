"""What the anchors give, over the whole grid for the field and along a path exactly; also while they move."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from planning.kernels import path_fields as kernel
from planning.questions.models import MEASURES
from planning.questions.problems import PathProblem
from terrain import height_at
from visibility import Anchor, DistantAnchor, MinimumVisibleAltitude, MovingAnchor, VisibilityInputError
from visibility.dilution import pack_sets, surface_normals
from visibility.dilution.dop import solve
from visibility.dilution.dop_questions import kind_code
from visibility.dilution.sets_in_sight import column_tables
from visibility.sight import SurfaceCache
from visibility.signal import min_usable_altitude

from .exact_lines import Enough, exact_lines
from .places import Cells, metres_of

__all__ = ["Positioning", "SightMaps", "Sightings", "anchor_places", "minimum_of", "sight_maps"]

Floats = npt.NDArray[np.float64]
Standing = Anchor | DistantAnchor
MOST_FRAMES = 64


class Antennas(NamedTuple):
    """Where the rover's antenna is over each post, as kernels take it, metres."""

    origin_east_m: float
    origin_north_m: float
    above_ground_m: float


class WantedDop(NamedTuple):
    """Which dilution is worked out. kind: its code. measure: its number. on_ground: the rover is bound to it."""

    kind: int
    measure: int
    on_ground: bool


@dataclass(frozen=True, eq=False, slots=True)
class Positioning:
    """What each square (rows - 1, cols - 1) gets of the anchors: count uint16, dop float32 where it is asked for."""

    count: npt.NDArray[np.uint16]
    dop: npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False, slots=True)
class Sightings:
    """What the anchors give at n points: visible (n, k) bool, margin_m (n, k) sight clearance, dop (n,)."""

    visible: npt.NDArray[np.bool_]
    margin_m: Floats
    dop: Floats


class SightMaps(Protocol):
    """The two questions that a plan asks of its anchors."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """About the anchors."""

    def positioning(self, arrival_s: Floats | None) -> Positioning:
        """Of every square, at the time (rows - 1, cols - 1) at which the rover gets there."""

    def sightings(self, places: Floats, times_s: Floats, enough: Enough | None = None) -> Sightings:
        """At fractional posts (n, 2) and times (n,) from the departure on, by exact sight lines.

        With ``enough`` what is not asked counts as hidden, and dilutions are NaN.
        """


def sight_maps(problem: PathProblem) -> SightMaps | None:
    """The maps of a problem's anchors; None where it has none. Raises AnchorError."""
    if problem.moves:
        return _Moving(problem)
    minimum = minimum_of(problem)
    return None if minimum is None else _Standing(problem, minimum)


def minimum_of(problem: PathProblem) -> MinimumVisibleAltitude | None:
    """The surfaces of anchors that stand, given or worked out; None where there are none. Raises AnchorError."""
    standing = tuple(anchor for anchor in problem.anchors if isinstance(anchor, Standing))
    if problem.minimum is not None or not standing:
        return problem.minimum
    antenna_m = problem.rover.receiver_above_ground_m
    return min_usable_altitude(problem.grid, standing, "exact", only_above_ground_m=antenna_m)


def anchor_places(problem: PathProblem, anchor: Standing | MovingAnchor, times_s: Floats) -> Floats:
    """(n, 3) east, north, altitude of an anchor at times from the departure on; NaN while there is none."""
    if isinstance(anchor, DistantAnchor):
        return np.broadcast_to(anchor.position_m(problem.grid), (len(times_s), 3))
    if isinstance(anchor, Anchor):
        return np.broadcast_to([anchor.east_m, anchor.north_m, anchor.altitude_m], (len(times_s), 3))
    found = np.full((len(times_s), 3), np.nan)
    for number, time_s in enumerate((problem.departure_s + times_s).tolist()):
        there = anchor_at(anchor, time_s)
        if there is not None:
            found[number] = anchor_places(problem, there, np.zeros(1))[0]
    return found


def anchor_at(anchor: Standing | MovingAnchor, time_s: float) -> Standing | None:
    """The anchor at a time; None while there is none, or nothing is known of it."""
    if isinstance(anchor, Anchor | DistantAnchor):
        return anchor
    try:
        return anchor.at(time_s)
    except VisibilityInputError:  # beyond its track an anchor is not counted on
        return None


@dataclass(frozen=True, eq=False)
class _Standing:
    """Anchors that stand still."""

    problem: PathProblem
    minimum: MinimumVisibleAltitude

    @property
    def warnings(self) -> tuple[str, ...]:
        return self.minimum.warnings

    def positioning(self, arrival_s: Floats | None) -> Positioning:
        del arrival_s  # it is the same at all times
        return _of_squares(self.problem, self.minimum)

    def sightings(self, places: Floats, times_s: Floats, enough: Enough | None = None) -> Sightings:
        del times_s
        points_m = _antennas(self.problem, places)
        got = exact_lines(self.minimum, points_m, enough)
        if enough is not None:
            return Sightings(got.visible, got.margin_m, np.full(len(places), np.nan))
        dop = _dilution(self.problem, self.minimum, points_m, got.visible)
        return Sightings(got.visible, got.margin_m, dop)


class _Moving:
    """Anchors of which some move: a map for each frame, and exact lines at the exact time."""

    def __init__(self, problem: PathProblem) -> None:
        self._problem = problem
        usable = partial(min_usable_altitude, only_above_ground_m=problem.rover.receiver_above_ground_m)
        self._cache = SurfaceCache(problem.grid, "exact", calculate=usable)
        self._frames: dict[float, Positioning] = {}

    @property
    def warnings(self) -> tuple[str, ...]:
        return ()

    def positioning(self, arrival_s: Floats | None) -> Positioning:
        if arrival_s is None:
            return self._frame(0.0)
        problem = self._problem
        known = arrival_s[np.isfinite(arrival_s)]
        frame_s = max(problem.frame_s, float(known.max(initial=0.0)) / MOST_FRAMES)
        frame = np.where(np.isfinite(arrival_s), np.floor(arrival_s / frame_s), 0.0)
        count, dop = np.zeros(arrival_s.shape, np.uint16), np.zeros(arrival_s.shape, np.float32)
        for number in np.unique(frame).tolist():
            there = frame == number
            found = self._frame((number + 0.5) * frame_s)
            count[there], dop[there] = found.count[there], found.dop[there]
        return Positioning(count, dop)

    def _frame(self, time_s: float) -> Positioning:
        if time_s not in self._frames:
            minimum = self._minimum(time_s)
            shape = self._problem.grid.rows - 1, self._problem.grid.cols - 1
            nothing = Positioning(np.zeros(shape, np.uint16), np.full(shape, np.inf, np.float32))
            self._frames[time_s] = nothing if minimum is None else _of_squares(self._problem, minimum)
        return self._frames[time_s]

    def _minimum(self, time_s: float) -> MinimumVisibleAltitude | None:
        at_s = self._problem.departure_s + time_s
        here = [anchor_at(anchor, at_s) for anchor in self._problem.anchors]
        present = tuple(anchor for anchor in here if anchor is not None)
        return self._cache.surfaces(present) if present else None

    def sightings(self, places: Floats, times_s: Floats, enough: Enough | None = None) -> Sightings:
        problem = self._problem
        points_m, k = _antennas(problem, places), len(problem.anchors)
        visible, margin_m = np.zeros((len(places), k), np.bool_), np.full((len(places), k), np.nan)
        dop = np.full(len(places), np.inf if enough is None else np.nan)
        # to the second: an anchor moves little in half of one, and a rover less
        second = np.round(times_s)
        for time_s in np.unique(second).tolist():
            at = np.flatnonzero(second == time_s)
            here = [anchor_at(anchor, problem.departure_s + time_s) for anchor in problem.anchors]
            which = np.array([number for number, anchor in enumerate(here) if anchor is not None], np.intp)
            if len(which) == 0:
                continue
            minimum = _lines_only(problem, tuple(anchor for anchor in here if anchor is not None), self._cache)
            of_these = enough and enough._replace(order=tuple(np.argsort(np.argsort(enough.order)[which]).tolist()))
            got = exact_lines(minimum, points_m[at], of_these)
            visible[np.ix_(at, which)], margin_m[np.ix_(at, which)] = got.visible, got.margin_m
            if enough is None:
                dop[at] = _dilution(problem, minimum, points_m[at], got.visible)
        return Sightings(visible, margin_m, dop)


def _lines_only(problem: PathProblem, anchors: tuple[Standing, ...], cache: SurfaceCache) -> MinimumVisibleAltitude:
    """Anchors as the exact lines want them; surfaces only where satellites need them."""
    if any(isinstance(anchor, DistantAnchor) for anchor in anchors):
        return cache.surfaces(anchors)
    none = np.zeros((0, *problem.grid.shape), np.float32)
    return MinimumVisibleAltitude(
        problem.grid, anchors, none, none, "exact", cache.unknown, cache.curvature, (), 0.0, ""
    )


def _antennas(problem: PathProblem, places: Floats) -> Floats:
    """(n, 3) of the antenna over fractional posts."""
    east_m, north_m = metres_of(problem.grid, places)
    ground_m = height_at(problem.grid, east_m, north_m)
    return np.column_stack([east_m, north_m, ground_m + problem.rover.receiver_above_ground_m])


def _dilution(
    problem: PathProblem, minimum: MinimumVisibleAltitude, points_m: Floats, visible: npt.NDArray[np.bool_]
) -> Floats:
    limits = problem.limits
    normals = surface_normals(problem.grid, points_m[:, 0], points_m[:, 1]) if limits.on_surface else None
    unknown = np.isnan(points_m[:, 2])
    found = solve(points_m, column_tables(minimum).sources, pack_sets(visible), unknown, limits.kind, normals)
    dop: Floats = getattr(found, limits.measure)
    return dop


def _of_squares(problem: PathProblem, minimum: MinimumVisibleAltitude) -> Positioning:
    grid, limits, antenna_m = problem.grid, problem.limits, problem.rover.receiver_above_ground_m
    count = np.zeros((grid.rows - 1, grid.cols - 1), np.uint16)
    dop = np.zeros(count.shape, np.float32)
    seen = minimum.visible(above_ground_m=antenna_m)
    weights = problem.weights
    if math.isinf(limits.dop_limit) and weights.dop == 0.0 and weights.position_error == 0.0:
        kernel.fill_counts(seen, count)
        return Positioning(count, dop)
    antennas = Antennas(grid.origin_east_m, grid.origin_north_m, antenna_m)
    wanted = WantedDop(kind_code(limits.kind), MEASURES.index(limits.measure), limits.on_surface)
    sources = column_tables(minimum).sources
    kernel.fill_positioning(grid.heights_m, Cells.of(grid), seen, antennas, sources, wanted, count, dop)
    return Positioning(count, dop)
