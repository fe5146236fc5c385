"""The stretch of path that a rover drives next, from where it is seen, and what moving a drone there costs.

Sight has no direction: the minimum visible altitudes of an anchor at the rover's place tell, for every post, from which
altitude up a drone over it is seen. A handful of sweeps from the stretch so answer for every place at every height.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from planning.errors import PlacementError
from terrain import ElevationGrid
from visibility import Anchor, min_visible_altitude
from visibility.signal import Radio

from .cluster import anchors_table, sight_table
from .goals import Goal
from .judges import CountJudge, GeometryJudge, Problem, shown_value
from .placing import anchor_rows
from .sight import Bits, SightOptions, SightTable, pack, sampled_targets
from .targets import Targets, path_targets

__all__ = [
    "Flight",
    "SeenStretch",
    "flight_costs",
    "flight_level_m",
    "good_along",
    "path_between",
    "path_length_m",
    "problem_along",
    "straight_ahead",
    "value_over",
    "worth_over",
]

Floats = npt.NDArray[np.float64]
SAMPLES = 96  # of the ground below each flight, at most
AT_ONCE = 16_384  # flights, so that their samples stay in the cache
MOST_POINTS = 24  # of a stretch that are swept from


@dataclass(frozen=True, slots=True)
class Flight:
    """How a drone flies from place to place.

    speeds in m/s. clearance_m: kept above the ground on the way. max_flight_m: longest flight path of one move.
    Raises PlacementError.
    """

    speed_m_per_s: float = 12.0
    climb_m_per_s: float = 3.0
    descent_m_per_s: float = 2.0
    clearance_m: float = 20.0
    max_flight_m: float = math.inf

    def __post_init__(self) -> None:
        for name in ("speed_m_per_s", "climb_m_per_s", "descent_m_per_s"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise PlacementError(f"{name} must be a speed > 0 m/s, not {getattr(self, name)}.")
        if not (math.isfinite(self.clearance_m) and self.clearance_m >= 0.0) or not self.max_flight_m > 0.0:
            raise PlacementError("A flight needs clearance_m >= 0 and max_flight_m > 0.")


def flight_costs(grid: ElevationGrid, flight: Flight, from_m: Floats, to_m: Floats) -> tuple[Floats, Floats]:
    """(metres of flight path, seconds), both (n,), from one place (3,) to others (n, 3).

    Straight up to a level that clears the ground below the whole way, level, straight down. Ground outside the DEM or
    unknown is not cleared.
    """
    parts = [to_m[start : start + AT_ONCE] for start in range(0, max(len(to_m), 1), AT_ONCE)]
    below_m = np.concatenate([_highest_below(grid, from_m, part) for part in parts])
    level_m = np.maximum(np.maximum(from_m[2], to_m[:, 2]), below_m + flight.clearance_m)
    across_m = np.hypot(to_m[:, 0] - from_m[0], to_m[:, 1] - from_m[1])
    still = across_m == 0.0
    level_m[still] = np.maximum(from_m[2], to_m[still, 2])
    climb_m, descent_m = level_m - from_m[2], level_m - to_m[:, 2]
    seconds = climb_m / flight.climb_m_per_s + across_m / flight.speed_m_per_s + descent_m / flight.descent_m_per_s
    return climb_m + across_m + descent_m, seconds


def flight_level_m(from_m: Sequence[float], to_m: Sequence[float], flight_m: float) -> float:
    """Altitude at which a flight of that length between two places (east, north, altitude) goes level."""
    return (flight_m - math.dist(from_m[:2], to_m[:2]) + from_m[2] + to_m[2]) / 2.0


def _highest_below(grid: ElevationGrid, from_m: Floats, to_m: Floats) -> Floats:
    """(n,) highest post beside each straight way; -inf where none is known."""
    row_0, col_0 = grid.post_at(from_m[0], from_m[1])
    row_1 = (grid.origin_north_m - to_m[:, 1]) / grid.cell_north_m
    col_1 = (to_m[:, 0] - grid.origin_east_m) / grid.cell_east_m
    posts = np.maximum(np.abs(row_1 - row_0), np.abs(col_1 - col_0)).max(initial=0.0)
    share = np.linspace(0.0, 1.0, int(min(SAMPLES, 2 * math.ceil(posts) + 1)))[:, None]
    row = np.rint(row_0 + share * (row_1 - row_0)).astype(np.intp)
    col = np.rint(col_0 + share * (col_1 - col_0)).astype(np.intp)
    inside = (row >= 0) & (row < grid.rows) & (col >= 0) & (col < grid.cols)
    height_m = grid.heights_m[np.where(inside, row, 0), np.where(inside, col, 0)]
    highest: Floats = np.where(inside & ~np.isnan(height_m), height_m, -np.inf).max(axis=0).astype(np.float64)
    return highest


def straight_ahead(east_m: float, north_m: float, heading_rad: float, length_m: float) -> Floats:
    """(2, 2) path from a place along a heading, clockwise from grid north."""
    if not (math.isfinite(heading_rad) and math.isfinite(length_m) and length_m > 0.0):
        raise PlacementError(f"A stretch ahead needs a heading and a length > 0 m, not {heading_rad} and {length_m}.")
    end = (east_m + length_m * math.sin(heading_rad), north_m + length_m * math.cos(heading_rad))
    return np.array([(east_m, north_m), end])


def path_length_m(path_m: npt.ArrayLike) -> float:
    """How long a path (n, 2) is."""
    return float(np.hypot(*np.diff(np.asarray(path_m, np.float64), axis=0).T).sum())


def path_between(path_m: npt.ArrayLike, from_m: float, to_m: float) -> Floats:
    """The part (n, 2) of a path (k, 2) between two distances along it, metres; cut at its ends."""
    path = np.asarray(path_m, np.float64)
    along_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    low_m, high_m = max(from_m, 0.0), min(to_m, float(along_m[-1]))
    if not low_m < high_m:
        raise PlacementError(f"Nothing of the path lies between {from_m:g} and {to_m:g} m along it.")
    inner = (along_m > low_m) & (along_m < high_m)
    at_m = np.concatenate([[low_m], along_m[inner], [high_m]])
    return np.column_stack([np.interp(at_m, along_m, path[:, axis]) for axis in (0, 1)])


@dataclass(frozen=True, slots=True, eq=False)
class SeenStretch:
    """A stretch of path with what sees it. targets: all points; few: some of them; altitude_m: (few, rows, cols)."""

    grid: ElevationGrid
    targets: Targets
    few: Targets
    altitude_m: npt.NDArray[np.float32]
    options: SightOptions

    @classmethod
    def of(
        cls, grid: ElevationGrid, path_m: npt.ArrayLike, above_ground_m: float, options: SightOptions
    ) -> SeenStretch:
        """Sweep from points along the stretch. Raises PlacementError."""
        targets = path_targets(grid, path_m, above_ground_m)
        few = sampled_targets(
            targets, np.unique(np.linspace(0, len(targets) - 1, min(MOST_POINTS, len(targets))).round().astype(np.intp))
        )
        rover = [Anchor(f"{n}", *point) for n, point in enumerate(few.point_m.tolist())]
        surfaces = min_visible_altitude(grid, rover, options.mode, options.curvature, unknown=options.unknown)
        return cls(grid, targets, few, surfaces.altitude_m, options)

    def seen_from_posts(self, post: npt.NDArray[np.intp], position_m: Floats, radio: Radio | None = None) -> Bits:
        """(n, 1) which of the few points are seen from places (n, 3) straight above posts (n,).

        With a radio by its signal, line by line.
        """
        if radio is not None:
            return sight_table(self.grid, self.few, position_m, replace(self._exact, radio=radio)).table.bits
        seen = position_m[:, 2].astype(np.float32) >= self.altitude_m.reshape(len(self.few), -1)[:, post]
        away_m2 = ((self.few.point_m[:, None, :] - position_m[None, :, :]) ** 2).sum(axis=2)
        return pack((seen & (away_m2 <= self.options.max_range_m**2)).T)

    def seen_from(self, anchors: Sequence[Anchor], targets: Targets) -> Bits:
        """(n, words) which targets get anchors, line by line."""
        return anchors_table(self.grid, targets, anchors, self._exact).bits

    @property
    def _exact(self) -> SightOptions:
        return replace(self.options, mode="exact")


def value_over(stretch: SeenStretch, anchors: Sequence[Anchor], goal: Goal) -> float:
    """The goal's share over all points of a stretch, line by line."""
    return worth_over(stretch, anchors, goal)[0]


def worth_over(stretch: SeenStretch, anchors: Sequence[Anchor], goal: Goal) -> tuple[float, float]:
    """(the same, the mean part of the anchors that the goal needs in sight), both 0..1."""
    bits = stretch.seen_from(anchors, stretch.targets)
    problem = problem_along(stretch.targets, goal, anchors, bits, np.zeros((0, 4)), None)
    everyone = list(range(len(anchors)))
    partly = CountJudge(problem, goal.needed_with_spare, partial=True).value(everyone)
    return shown_value(problem, everyone), partly


def good_along(
    grid: ElevationGrid, targets: Targets, anchors: Sequence[Anchor], goal: Goal, sight: SightOptions
) -> npt.NDArray[np.bool_]:
    """(m,) which points have what a goal that is a share asks for."""
    if not anchors:
        return np.zeros(len(targets), np.bool_)
    bits = anchors_table(grid, targets, anchors, replace(sight, mode="exact")).bits
    problem = problem_along(targets, goal, anchors, bits, np.zeros((0, 4)), None)
    return np.asarray(GeometryJudge(problem).of_targets(list(range(len(anchors)))) > 0.5)


def problem_along(
    targets: Targets,
    goal: Goal,
    others: Sequence[Anchor],
    others_bits: npt.NDArray[np.uint64],
    rows: Floats,
    bits: npt.NDArray[np.uint64] | None,
) -> Problem:
    """Others fixed and places as candidates; or the others as candidates where there are no places."""
    points = len(targets)
    words = others_bits.shape[1]
    none = SightTable(np.zeros((0, words), np.uint64), points)
    seen = SightTable(others_bits, points)
    if bits is None:
        return Problem(targets, goal, anchor_rows(others, goal), seen, np.zeros((0, 4)), none)
    return Problem(targets, goal, rows, SightTable(bits, points), anchor_rows(others, goal), seen)
