"""The validator's look at the ground: slopes and steps, areas and ends, arcs that a rover can drive."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
import shapely

from terrain import ElevationGrid, height_at

from .reports import LimitCheck, PathLimit, check_of
from .walking import Walk

__all__ = ["area_checks", "ground_checks", "place_checks", "turning_checks"]

Numbers = npt.NDArray[np.float64]

ANGLE_SLACK_RAD = 1e-6
STEP_SLACK_M = 1e-4
# places on the rim of the footprint that are looked at
RIM = 24
PLACES_AT_ONCE = 2_000_000
Place = tuple[float, float]
Area: TypeAlias = "shapely.Polygon | shapely.MultiPolygon"
# a path may be rounded to centimetres on its way into a file
PLACE_SLACK_M = 0.01
AREA_SLACK_M = 1e-6
# Vertices on an arc of the radius itself are that far off by rounding, and where an arc begins between two of them.
RADIUS_SLACK = 0.02
# A bend of more than this at one vertex is a corner and no arc.
SHARPEST_BEND_RAD = math.radians(30.0)
HEADING_SLACK_RAD = 2e-3


def ground_checks(
    walk: Walk,
    *,
    footprint_radius_m: float,
    max_slope_rad: float,
    max_pitch_rad: float,
    max_roll_rad: float,
    max_step_m: float,
) -> list[LimitCheck]:
    """Known ground under the whole footprint; slope, pitch and roll of the triangle under its middle; steps under it.

    A step is how far ground under the footprint departs from the plane of the triangle under its middle.
    """
    unknown, step_m = _under_footprint(walk, footprint_radius_m, wants_steps=math.isfinite(max_step_m))
    checks = [check_of(walk, PathLimit.KNOWN_GROUND, unknown, 0.0)]
    for limit, tangents, allowed in (
        (PathLimit.SLOPE, walk.slope, max_slope_rad),
        (PathLimit.PITCH, walk.along, max_pitch_rad),
        (PathLimit.ROLL, walk.across, max_roll_rad),
    ):
        angle = np.arctan(np.abs(tangents).max(axis=1))
        checks.append(check_of(walk, limit, angle, allowed, slack=ANGLE_SLACK_RAD, ignore_nan=True))
    if step_m is not None:
        checks.append(check_of(walk, PathLimit.STEP, step_m, max_step_m, slack=STEP_SLACK_M, ignore_nan=True))
    return checks


def _under_footprint(walk: Walk, radius_m: float, wants_steps: bool) -> tuple[Numbers, Numbers | None]:
    """(1 where some ground under the footprint is unknown, metres of the largest step; NaN over unknown ground)."""
    offsets = _offsets(radius_m)
    unknown, step_m = np.empty(len(walk)), np.full(len(walk), np.nan)
    batch = max(PLACES_AT_ONCE // len(offsets), 1)
    for first in range(0, len(walk), batch):
        part = slice(first, first + batch)
        places = walk.place_m[part, None, :] + offsets
        posts = _posts_within(walk.grid, walk.place_m[part], radius_m)
        if posts is not None:
            places = np.concatenate([places, posts], axis=1)
        ground_m = height_at(walk.grid, places[..., 0], places[..., 1])
        missing = np.isnan(ground_m) & ~np.isnan(places[..., 0])
        unknown[part] = missing.any(axis=1) | np.isnan(walk.gradients[part]).any(axis=(1, 2))
        if wants_steps:
            away = places - walk.place_m[part, None, :]
            for side in range(walk.gradients.shape[1]):
                plane_m = walk.ground_m[part, None] + (away * walk.gradients[part, None, side, :]).sum(axis=-1)
                apart_m = np.abs(ground_m - plane_m)
                step_m[part] = np.fmax(step_m[part], np.where(np.isnan(apart_m), 0.0, apart_m).max(axis=1))
    step_m[unknown > 0.0] = np.nan
    return unknown, step_m if wants_steps else None


def _offsets(radius_m: float) -> Numbers:
    """(k, 2) places of the footprint relative to its middle, besides the posts in it: middle and rim."""
    turn = np.linspace(0.0, 2.0 * math.pi, RIM, endpoint=False)
    rim = radius_m * np.column_stack([np.sin(turn), np.cos(turn)])
    return np.concatenate([np.zeros((1, 2)), rim]) if radius_m > 0.0 else np.zeros((1, 2))


def _posts_within(grid: ElevationGrid, place_m: Numbers, radius_m: float) -> Numbers | None:
    """(n, k, 2) the posts under each footprint, NaN where a post of the window is not; ground bends at posts."""
    if radius_m == 0.0:
        return None
    down, across = int(radius_m / grid.cell_north_m) + 1, int(radius_m / grid.cell_east_m) + 1
    row = np.rint((grid.origin_north_m - place_m[:, 1]) / grid.cell_north_m)
    col = np.rint((place_m[:, 0] - grid.origin_east_m) / grid.cell_east_m)
    rows, cols = np.mgrid[-down : down + 1, -across : across + 1].reshape(2, -1)
    east_m = grid.origin_east_m + (col[:, None] + cols) * grid.cell_east_m
    north_m = grid.origin_north_m - (row[:, None] + rows) * grid.cell_north_m
    posts = np.stack([east_m, north_m], axis=-1)
    posts[np.hypot(*(posts - place_m[:, None, :]).transpose(2, 0, 1)) > radius_m] = np.nan
    return posts


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


def turning_checks(
    walk: Walk, *, min_turning_radius_m: float, can_reverse: bool, start_heading_rad: float | None
) -> list[LimitCheck]:
    """The circle through each three vertices in a row must not be smaller than the turning radius, nor the bend sharp.

    can_reverse: at a cusp, where the way turns back, it is the way on seen backwards that counts.
    start_heading_rad: clockwise from grid north; the first leg must be a chord of an arc that begins with it.
    """
    if min_turning_radius_m == 0.0 or len(walk.corners_m) < 2:
        return []
    at = np.flatnonzero(walk.vertex >= 0)
    legs = np.diff(walk.corners_m, axis=0)
    checks = []
    if len(legs) > 1:
        radius_m = _radii_m(legs[:-1], legs[1:], can_reverse)
        slack_m = RADIUS_SLACK * min_turning_radius_m
        checks.append(
            check_of(walk, PathLimit.TURNING, radius_m, min_turning_radius_m, at_least=True, slack=slack_m, at=at[1:-1])
        )
    if start_heading_rad is not None:
        ahead = np.array([[math.sin(start_heading_rad), math.cos(start_heading_rad)]])
        off = _bend(ahead, legs[:1])
        if can_reverse:
            off = np.minimum(off, math.pi - off)
        first_m = float(np.hypot(*legs[0]))
        allowed = math.asin(min(first_m / (2.0 * min_turning_radius_m), 1.0))
        checks.append(check_of(walk, PathLimit.START_HEADING, off, allowed, slack=HEADING_SLACK_RAD, at=at[:1]))
    return checks


def _radii_m(before: Numbers, after: Numbers, can_reverse: bool) -> Numbers:
    """(n,) radius of the circle through the ends of two legs (n, 2); 0 at a corner, inf straight on."""
    bend = _bend(before, after)
    if can_reverse:
        back = bend > math.pi / 2
        after = np.where(back[:, None], -after, after)
        bend = np.where(back, math.pi - bend, bend)
    across_m = np.hypot(*(before + after).T)
    sine = np.sin(bend)
    straight = sine < 1e-12
    radius_m = np.where(straight, np.inf, across_m / (2.0 * np.where(straight, 1.0, sine)))
    return np.where(bend > SHARPEST_BEND_RAD, 0.0, radius_m)


def _bend(before: Numbers, after: Numbers) -> Numbers:
    """(n,) angle between two directions, 0 to pi."""
    turned = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    bend: Numbers = np.arctan2(np.abs(turned), (before * after).sum(axis=1))
    return bend
