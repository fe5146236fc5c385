"""Where a path must begin, pass and end, and the areas it must stay out of and within."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
import shapely

from .reports import LimitCheck, PathLimit, check_of
from .walking import Walk

__all__ = ["area_checks", "place_checks"]

Numbers = npt.NDArray[np.float64]
Place = tuple[float, float]
Area: TypeAlias = "shapely.Polygon | shapely.MultiPolygon"

# a path may be rounded to centimetres on its way into a file
PLACE_SLACK_M = 0.01
AREA_SLACK_M = 1e-6


def place_checks(
    walk: Walk, start: Place, way_points: Sequence[Place], goals: Sequence[Place | Area]
) -> list[LimitCheck]:
    """The first vertex is the start, way-points are vertices in their order, the last vertex is at one of the goals."""
    corners, at = walk.corners_m, np.flatnonzero(walk.vertex >= 0)
    off_m = float(np.hypot(*(corners[0] - start)))
    checks = [check_of(walk, PathLimit.START, [off_m], 0.0, slack=PLACE_SLACK_M, at=at[:1])]
    if way_points:
        missed_m, nearest = _missed_m(corners, way_points)
        checks.append(check_of(walk, PathLimit.WAY_POINTS, missed_m, 0.0, slack=PLACE_SLACK_M, at=at[nearest]))
    end = shapely.Point(corners[-1])
    left_m = min(
        float(end.distance(goal if isinstance(goal, shapely.Geometry) else shapely.Point(goal))) for goal in goals
    )
    checks.append(check_of(walk, PathLimit.GOAL, [left_m], 0.0, slack=PLACE_SLACK_M, at=at[-1:]))
    return checks


def area_checks(
    walk: Walk, footprint_radius_m: float, no_go: Sequence[Area], keep_in: Sequence[Area]
) -> list[LimitCheck]:
    """The whole footprint stays out of every no-go area and within the keep-in areas; exact along each leg.

    Values are distances of the rover's middle, negative by how much of a leg lies where it must not be.
    """
    corners = walk.corners_m
    ends = np.stack([corners[:-1], corners[1:]], axis=1) if len(corners) > 1 else np.repeat(corners[:, None], 2, axis=1)
    legs = shapely.linestrings(ends)
    at = np.flatnonzero(walk.vertex >= 0)[: len(legs)]
    checks = []
    if no_go:
        forbidden = shapely.union_all(list(no_go))
        clear_m = _outside_m(legs, forbidden)
        checks.append(_area_check(walk, PathLimit.NO_GO, clear_m, footprint_radius_m, at))
    if keep_in:
        allowed = shapely.union_all(list(keep_in))
        clear_m = np.where(
            shapely.covers(allowed, legs),
            shapely.distance(legs, shapely.boundary(allowed)),
            -np.maximum(shapely.length(shapely.difference(legs, allowed)), shapely.distance(legs, allowed)),
        )
        # wholly outside, and no longer than a point
        clear_m = np.where((clear_m == 0.0) & ~shapely.covers(allowed, legs), -1.0, clear_m)
        checks.append(_area_check(walk, PathLimit.KEEP_IN, clear_m, footprint_radius_m, at))
    return checks


def _area_check(
    walk: Walk, limit: PathLimit, clear_m: Numbers, radius_m: float, at: npt.NDArray[np.int64]
) -> LimitCheck:
    return check_of(walk, limit, clear_m, radius_m, at_least=True, slack=AREA_SLACK_M, at=at)


def _outside_m(legs: npt.NDArray[np.object_], area: Area) -> Numbers:
    """(n,) distance of each leg from an area, negative by how much of it runs inside."""
    inside_m = shapely.length(shapely.intersection(legs, area))
    within = shapely.contains(area, shapely.line_interpolate_point(legs, 0.5, normalized=True))
    # along the border a leg has length in common with the area, and is not in it
    border_m = shapely.length(shapely.intersection(legs, shapely.boundary(area)))
    depth_m = np.where(within, np.maximum(inside_m - border_m, AREA_SLACK_M * 10.0), inside_m - border_m)
    outside: Numbers = np.where(depth_m > AREA_SLACK_M, -depth_m, shapely.distance(legs, area))
    return outside


def _missed_m(corners: Numbers, way_points: Sequence[Place]) -> tuple[Numbers, npt.NDArray[np.int64]]:
    """(how far each way-point is from the vertices after the one before it, number of the nearest such vertex)."""
    missed_m, nearest = np.empty(len(way_points)), np.empty(len(way_points), np.int64)
    first = 0
    for number, place in enumerate(way_points):
        apart_m = np.hypot(*(corners[first:] - place).T)
        # the first vertex that is there; with none the nearest, so that the next is still looked for
        there = np.flatnonzero(apart_m <= PLACE_SLACK_M)
        step = int(there[0]) if len(there) else int(np.argmin(apart_m))
        missed_m[number] = apart_m[step]
        nearest[number] = first = first + step
    return missed_m, nearest
