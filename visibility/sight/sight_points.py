"""Points in the grid's frame, as callers give them: checked, and expressed in posts."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.errors import VisibilityInputError
from visibility.sight.anchors import FURTHEST_USEFUL_M, Anchor
from visibility.sight.antenna_limits import ALL_ROUND, limits_of
from visibility.sight.curvature import Curvature

__all__ = ["check_point", "check_points", "checked_positions", "horizontal_box", "in_posts", "points_within_reach"]

# rounding of an angle, radians, and of a range, as a share of it, leaves nobody out
SLACK = 1e-9


def check_point(grid: ElevationGrid, name: str, point_m: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """(3,) float64 copy of one point given as east, north, altitude; raises VisibilityInputError that names it."""
    if np.shape(point_m) != (3,):
        raise VisibilityInputError(
            f"{name} must be three numbers, east, north and altitude in metres, not shape {np.shape(point_m)}."
        )
    point: npt.NDArray[np.float64] = check_points(grid, name, point_m)[0]
    return point


def checked_positions(name: str, values_m: npt.ArrayLike, *, or_one: bool = False) -> npt.NDArray[np.float64]:
    """(n, 3) C-contiguous float64 copy of finite positions, each its east, north and altitude, metres.

    name: what sentences call them. or_one: a single position (3,) is taken as well, and told without a number.
    Raises VisibilityInputError, naming the first position that is none.
    """
    try:
        given = np.array(values_m, np.float64, order="C")
    except (TypeError, ValueError) as fault:
        raise VisibilityInputError(
            f"{name} must hold numbers: east, north and altitude in metres ({fault})."
        ) from fault
    if given.size == 0:
        return np.empty((0, 3))
    rows = given[None] if or_one and given.ndim == 1 else given
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise VisibilityInputError(
            f"{name} must hold one row of east, north and altitude in metres for each, not shape {given.shape}."
        )
    broken = ~np.isfinite(rows).all(axis=1)
    if broken.any():
        first = int(np.argmax(broken))
        told = f"{name}[{first}]" if rows is given else name
        raise VisibilityInputError(f"{told} must be three finite numbers, not {rows[first].tolist()}.")
    return rows


def check_points(grid: ElevationGrid, name: str, points_m: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """(n, 3) float64 copy of points given as east, north, altitude; raises VisibilityInputError naming the offender."""
    points = checked_positions(name, points_m, or_one=True)
    if len(points) == 0:
        return points
    low_m, high_m = horizontal_box(grid)
    outside_m = np.hypot(*np.maximum(np.maximum(low_m - points[:, :2], points[:, :2] - high_m), 0.0).T)
    if outside_m.max() > FURTHEST_USEFUL_M:
        first = int(np.argmax(outside_m))
        one = f"{name}[{first}]" if np.ndim(points_m) == 2 else name
        raise VisibilityInputError(
            f"{one} is {outside_m[first] / 1000.0:.0f} km outside the DEM (limit "
            f"{FURTHEST_USEFUL_M / 1000.0:.0f} km); are its coordinates in the DEM's CRS?"
        )
    return points


def horizontal_box(grid: ElevationGrid) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """((west, south), (east, north)) of the outermost posts, metres."""
    west_m, south_m, east_m, north_m = grid.bounds_m
    return np.array([west_m, south_m]), np.array([east_m, north_m])


def in_posts(grid: ElevationGrid, points_m: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """(n, 3) fractional row, fractional column and altitude of points given as east, north, altitude."""
    posts = np.empty(points_m.shape)  # in C order whatever theirs: the kernels know no other
    posts[:, 0] = (grid.origin_north_m - points_m[:, 1]) / grid.cell_north_m
    posts[:, 1] = (points_m[:, 0] - grid.origin_east_m) / grid.cell_east_m
    posts[:, 2] = points_m[:, 2]
    return posts


def points_within_reach(
    anchor: Anchor, points_m: npt.NDArray[np.float64], curvature: Curvature
) -> npt.NDArray[np.bool_]:
    """(n,) bool: whether points (n, 3) east, north, altitude are within the antenna's limits, terrain apart."""
    if anchor.limits == ALL_ROUND:
        return np.ones(len(points_m), np.bool_)
    limits = limits_of(anchor.limits)
    east_m, north_m = points_m[:, 0] - anchor.east_m, points_m[:, 1] - anchor.north_m
    flat_m = np.hypot(east_m, north_m)
    up_m = points_m[:, 2] - anchor.altitude_m - curvature.drop_per_m2 * flat_m**2
    range_m, elevation_rad = np.hypot(flat_m, up_m), np.arctan2(up_m, flat_m)
    within = (range_m >= limits.min_range_m * (1.0 - SLACK)) & (range_m <= limits.max_range_m * (1.0 + SLACK))
    within &= (elevation_rad >= math.atan(limits.tan_min_elevation) - SLACK) & (
        elevation_rad <= math.atan(limits.tan_max_elevation) + SLACK
    )
    turned_rad = (np.arctan2(east_m, north_m) - limits.azimuth_from_rad + SLACK) % (2.0 * math.pi)
    within &= (turned_rad <= limits.azimuth_width_rad + 2.0 * SLACK) | (flat_m == 0.0)
    return np.asarray(within, np.bool_)
