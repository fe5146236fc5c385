"""Every limit of a flight, checked along its corners: exact distance to the ground, floor and ceiling of the air."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planning.errors import PathError

# the planner imports us; at run time the question is all that goes between
from planning.questions.flight_problems import FlightProblem
from terrain import ElevationGrid, height_at, nearest_surface

from .reports import PathLimit, PathValidation, check_of

__all__ = ["FlightSamples", "fly_along", "validate_flight"]

Numbers = npt.NDArray[np.float64]

STEPS_PER_CELL = 4
# heights and floors are kept as float32
SLACK_M = 2e-3
PLACE_SLACK_M = 1e-6


@dataclass(frozen=True, eq=False, slots=True)
class FlightSamples:
    """A flight at fine steps. point_m: (n, 3); place_m: (n, 2) of them; distance_m: (n,) flown.

    ground_m: (n,) NaN over unknown ground and outside. clearance_m: (n,) to the nearest ground, or to unknown ground
        beside it; negative below the ground, NaN over unknown ground.
    floor_m: (n,) of the morphing map, +inf where it has none, NaN without a map. top_m: (n,) ceiling, +inf = none.
    """

    grid: ElevationGrid
    point_m: Numbers
    distance_m: Numbers
    ground_m: Numbers
    clearance_m: Numbers
    floor_m: Numbers
    top_m: Numbers

    @property
    def place_m(self) -> Numbers:
        """(n, 2) east, north."""
        return self.point_m[:, :2]

    def __len__(self) -> int:
        return len(self.point_m)


def fly_along(problem: FlightProblem, corners_m: npt.ArrayLike, *, step_m: float | None = None) -> FlightSamples:
    """The air along corners (n, 3) east, north, altitude; step_m between samples at most, None = a quarter of a cell.

    Raises PathError where the corners are no flight.
    """
    grid, corners = problem.grid, np.array(corners_m, np.float64)
    if corners.ndim != 2 or corners.shape[1] != 3 or len(corners) < 2 or not np.isfinite(corners).all():
        raise PathError("A flight must hold east, north and altitude of two corners or more, in finite metres.")
    apart_m = min(grid.cell_east_m, grid.cell_north_m) / STEPS_PER_CELL if step_m is None else step_m
    legs_m = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    along_m = np.concatenate([[0.0], np.cumsum(legs_m)])
    at_m = np.unique(np.concatenate([along_m, np.linspace(0.0, along_m[-1], math.ceil(along_m[-1] / apart_m) + 1)]))
    point_m = np.column_stack([np.interp(at_m, along_m, corners[:, axis]) for axis in range(3)])
    ground_m = height_at(grid, point_m[:, 0], point_m[:, 1])
    nearest = nearest_surface(grid, point_m)
    # unknown ground may be of any height
    clearance_m = np.minimum(nearest.distance_m, nearest.unknown_m)
    floor_m, top_m = np.full(len(at_m), np.nan), np.full(len(at_m), problem.ceiling_m)
    if problem.ceiling_above_ground:
        top_m += ground_m
    if problem.above is not None:
        above = problem.above
        floor_m = _between_posts(grid, above.safe_above_m, point_m)
        top_m = np.minimum(top_m, ground_m + above.ceiling_m if above.ceiling_above_ground else above.ceiling_m)
    return FlightSamples(grid, point_m, at_m, ground_m, clearance_m, floor_m, top_m)


def validate_flight(problem: FlightProblem, corners_m: npt.ArrayLike, *, step_m: float | None = None) -> PathValidation:
    """Walk a flight at fine steps and check every limit of the problem. Raises PathError."""
    air = fly_along(problem, corners_m, step_m=step_m)
    up_m, known = air.point_m[:, 2], np.where(np.isnan(air.ground_m), np.nan, 0.0)
    ends = [np.array([math.dist(air.point_m[n], end)]) for n, end in ((0, problem.start), (-1, problem.goal))]
    first, last = np.array([0]), np.array([len(air) - 1])
    checks = [
        check_of(air, PathLimit.START, ends[0], 0.0, slack=PLACE_SLACK_M, at=first),
        check_of(air, PathLimit.GOAL, ends[1], 0.0, slack=PLACE_SLACK_M, at=last),
        check_of(air, PathLimit.CLEARANCE, air.clearance_m + known, problem.bubble_m, at_least=True, slack=SLACK_M),
    ]
    if problem.above is not None:
        over_m = up_m - air.floor_m
        checks.append(check_of(air, PathLimit.MORPHING_MAP, over_m, 0.0, at_least=True, slack=SLACK_M))
    if problem.above is not None or math.isfinite(problem.ceiling_m):
        checks.append(check_of(air, PathLimit.CEILING, air.top_m - up_m, 0.0, at_least=True, slack=SLACK_M))
    return PathValidation(tuple(checks), float(np.diff(air.distance_m).max()), len(air), float(air.distance_m[-1]))


def _between_posts(grid: ElevationGrid, values_m: npt.NDArray[np.float32], point_m: Numbers) -> Numbers:
    """(n,) values of posts taken as a surface like the ground; NaN and +inf are +inf all over their triangles."""
    known = np.where(np.isfinite(values_m), values_m, np.nan)
    surface = ElevationGrid(known, grid.cell_east_m, grid.cell_north_m, grid.origin_east_m, grid.origin_north_m)
    between = height_at(surface, point_m[:, 0], point_m[:, 1])
    return np.where(np.isnan(between), np.inf, between)
