"""The validator's reports of whole paths and flights."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from planning.errors import PathError
from planning.questions.problems import FlightProblem, PathProblem
from terrain import ElevationGrid, height_at, nearest_surface
from visibility import Curvature
from visibility.air import MorphingMap
from visibility.cover import nearest_building, standing_solids

from .bubble import bubble_check
from .ground import area_checks, ground_checks, place_checks, turning_checks
from .reports import LimitCheck, PathLimit, PathValidation, check_of
from .sight import SightAlong, dilution_along, sight_along
from .walking import STEPS_PER_CELL, Walk, walk_along

__all__ = ["FlightSamples", "fly_along", "validate_flight", "validate_path"]

# the planner imports us; at run time the question is all that goes between


Numbers = npt.NDArray[np.float64]

ALTITUDE_SLACK_M = 1e-3
# heights and floors are kept as float32
SLACK_M = 2e-3
PLACE_SLACK_M = 1e-6


def validate_path(problem: PathProblem, vertices_m: npt.ArrayLike, *, step_m: float | None = None) -> PathValidation:
    """Walk a path at fine steps on the DEM and ask the exact sight lines; check every limit of the problem.

    vertices_m: (n, 2) east, north in the grid's frame; between them the path is straight. step_m: distance between
    samples at most; None = a quarter of a cell. No triangle of the ground is passed over, however small the corner
    that is cut. Raises PathError where the vertices are no path.
    """
    grid, rover = problem.grid, problem.rover
    vertices = _checked(vertices_m)
    if step_m is None:
        step_m = min(grid.cell_east_m, grid.cell_north_m) / STEPS_PER_CELL
    if not (math.isfinite(step_m) and step_m > 0.0):
        raise PathError(f"step_m must be a number of metres > 0, not {step_m}.")
    walk = walk_along(grid, vertices, rover.speed_at, step_m)
    checks = [
        *place_checks(walk, problem.start, problem.way_points, problem.goals),
        *ground_checks(
            walk,
            footprint_radius_m=rover.footprint_radius_m,
            max_slope_rad=rover.max_slope_rad,
            max_pitch_rad=rover.max_pitch_rad,
            max_roll_rad=rover.max_roll_rad,
            max_step_m=rover.max_step_m,
        ),
        *area_checks(walk, rover.footprint_radius_m, problem.no_go, problem.keep_in),
        *_positioning_checks(problem, walk),
        *turning_checks(
            walk,
            min_turning_radius_m=rover.min_turning_radius_m,
            can_reverse=rover.can_reverse,
            start_heading_rad=problem.start_heading_rad,
        ),
    ]
    return PathValidation(tuple(checks), step_m, len(walk), float(walk.distance_m[-1]))


def _checked(vertices_m: npt.ArrayLike) -> Numbers:
    try:
        vertices = np.array(vertices_m, np.float64)
    except (TypeError, ValueError) as error:
        raise PathError(f"A path must hold east and north of each vertex in metres ({error}).") from error
    if vertices.ndim != 2 or vertices.shape[1] != 2 or len(vertices) == 0:
        raise PathError(f"A path must hold east and north of each vertex in metres, not shape {vertices.shape}.")
    if not np.isfinite(vertices).all():
        first = int(np.argmin(np.isfinite(vertices).all(axis=1)))
        raise PathError(f"Vertex {first} of the path is not finite: {vertices[first].tolist()}.")
    return vertices


def _positioning_checks(problem: PathProblem, walk: Walk) -> list[LimitCheck]:
    limits = problem.limits
    antenna_m = np.column_stack([walk.place_m, walk.ground_m + problem.rover.receiver_above_ground_m])
    checks: list[LimitCheck] = []
    if problem.anchors and limits.on_positioning:
        sight = _sight(problem, walk, antenna_m)
        if limits.min_anchors > 0:
            checks.append(check_of(walk, PathLimit.ANCHORS, sight.count, limits.min_anchors, at_least=True))
        if math.isfinite(limits.dop_limit):
            worst = _worst_dilution(problem, walk, sight)
            checks.append(check_of(walk, PathLimit.DOP, worst, limits.dop_limit, below=True))
        if limits.bubble_epsilon > 0.0:
            checks.append(bubble_check(problem, walk, sight))
    if isinstance(problem.maps, MorphingMap):
        above_m = antenna_m[:, 2] - _between_posts(problem.grid, problem.maps.safe_above_m, walk.place_m)
        checks.append(check_of(walk, PathLimit.MORPHING_MAP, above_m, 0.0, at_least=True, slack=ALTITUDE_SLACK_M))
    return checks


def _sight(problem: PathProblem, walk: Walk, antenna_m: Numbers) -> SightAlong:
    minimum = problem.minimum
    curvature = Curvature.of(problem.grid) if minimum is None else minimum.curvature
    unknown = "unknown" if minimum is None else minimum.unknown
    return sight_along(problem.grid, antenna_m, problem.departure_s + walk.time_s, problem.anchors, curvature, unknown)


def _worst_dilution(problem: PathProblem, walk: Walk, sight: SightAlong) -> Numbers:
    """(n,) dilution; bound to the ground, the worst of the triangles that meet there."""
    limits = problem.limits
    if not limits.on_surface:
        return dilution_along(sight, limits.kind, limits.measure)
    upward = np.ones((len(walk), 1))
    triangles = [
        dilution_along(sight, limits.kind, limits.measure, np.hstack([-walk.gradients[:, number], upward]))
        for number in range(walk.gradients.shape[1])
    ]
    worst: Numbers = np.max(triangles, axis=0)
    return worst


# the planner imports us; at run time the question is all that goes between


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
    solids = standing_solids(grid)
    if solids is not None:
        clearance_m = np.minimum(clearance_m, nearest_building(solids, point_m).distance_m)
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
    if problem.keep_in:
        legs = shapely.linestrings(np.stack([air.place_m[:-1], air.place_m[1:]], axis=1))
        outside_m = shapely.length(shapely.difference(legs, shapely.union_all(list(problem.keep_in))))
        checks.append(check_of(air, PathLimit.OUTSIDE, outside_m, 0.0, slack=SLACK_M, at=np.arange(len(legs))))
    return PathValidation(tuple(checks), float(np.diff(air.distance_m).max()), len(air), float(air.distance_m[-1]))


def _between_posts(grid: ElevationGrid, values_m: npt.NDArray[np.float32], point_m: Numbers) -> Numbers:
    """(n,) values of posts taken as a surface like the ground; NaN and +inf are +inf all over their triangles."""
    known = np.where(np.isfinite(values_m), values_m, np.nan)
    surface = ElevationGrid(known, grid.cell_east_m, grid.cell_north_m, grid.origin_east_m, grid.origin_north_m)
    between = height_at(surface, point_m[:, 0], point_m[:, 1])
    return np.where(np.isnan(between), np.inf, between)
