"""The stretch of path that a rover drives next, and from where it is seen.

Sight has no direction: the minimum visible altitudes of an anchor at the rover's place tell, for every post, from which
altitude up a drone over it is seen. A handful of sweeps from the stretch so answer for every place at every height.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planning.errors import PlacementError
from terrain import ElevationGrid
from visibility import Anchor, min_visible_altitude

from .cluster import sight_table
from .judges import CountJudge, GeometryJudge, Goal, Problem, shown_value
from .placing import anchor_rows, positions_of
from .sight import Bits, SightOptions, SightTable, pack, sampled_targets
from .targets import Targets, path_targets

__all__ = [
    "SeenStretch",
    "good_along",
    "path_between",
    "path_length_m",
    "problem_along",
    "straight_ahead",
    "value_over",
    "worth_over",
]

Floats = npt.NDArray[np.float64]
MOST_POINTS = 24  # of a stretch that are swept from


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

    def seen_from_posts(self, post: npt.NDArray[np.intp], position_m: Floats) -> Bits:
        """(n, 1) which of the few points are seen from places (n, 3) straight above posts (n,)."""
        seen = position_m[:, 2].astype(np.float32) >= self.altitude_m.reshape(len(self.few), -1)[:, post]
        away_m2 = ((self.few.point_m[:, None, :] - position_m[None, :, :]) ** 2).sum(axis=2)
        return pack((seen & (away_m2 <= self.options.max_range_m**2)).T)

    def seen_from(self, position_m: Floats, targets: Targets) -> Bits:
        """(n, words) which targets are seen from places (n, 3), line by line."""
        exact = SightOptions("exact", self.options.curvature, self.options.max_range_m, self.options.unknown)
        return sight_table(self.grid, targets, position_m, exact).table.bits


def value_over(stretch: SeenStretch, anchors: Sequence[Anchor], goal: Goal) -> float:
    """The goal's share over all points of a stretch, line by line."""
    return worth_over(stretch, anchors, goal)[0]


def worth_over(stretch: SeenStretch, anchors: Sequence[Anchor], goal: Goal) -> tuple[float, float]:
    """(the same, the mean part of the anchors that the goal needs in sight), both 0..1."""
    bits = stretch.seen_from(positions_of(anchors), stretch.targets)
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
    exact = SightOptions("exact", sight.curvature, sight.max_range_m, sight.unknown)
    bits = sight_table(grid, targets, positions_of(anchors), exact).table.bits
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
