"""Every limit of a path problem, checked along a path that somebody says is good."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from planning.errors import PathError

# the planner imports us; at run time the question is all that goes between
from planning.questions.problems import PathProblem
from terrain import ElevationGrid, height_at
from visibility import Curvature
from visibility.air import MorphingMap

from .bubble import bubble_check
from .ground import ground_checks
from .places import area_checks, place_checks
from .reports import LimitCheck, PathLimit, PathValidation, check_of
from .sight import SightAlong, dilution_along, sight_along
from .turning import turning_checks
from .walking import STEPS_PER_CELL, Walk, walk_along

__all__ = ["validate_path"]

Numbers = npt.NDArray[np.float64]

ALTITUDE_SLACK_M = 1e-3


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
        above_m = antenna_m[:, 2] - _between_posts(problem.grid, problem.maps.safe_above_m, walk)
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


def _between_posts(grid: ElevationGrid, values_m: npt.NDArray[np.float32], walk: Walk) -> Numbers:
    """(n,) values of posts taken as a surface like the ground; NaN and +inf are +inf all over their triangles."""
    known = np.where(np.isfinite(values_m), values_m, np.nan)
    surface = ElevationGrid(known, grid.cell_east_m, grid.cell_north_m, grid.origin_east_m, grid.origin_north_m)
    between = height_at(surface, walk.place_m[:, 0], walk.place_m[:, 1])
    return np.where(np.isnan(between), np.inf, between)
