"""Visible sets at points anywhere over the grid, from minimum visible altitudes at its posts."""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel
from terrain.kernels import settled
from visibility.sight.kernels.reach import upper_bounds

__all__ = ["Antennas", "Surfaces", "Window", "sets_at_points"]


# columns of fractional posts
ROW, COL = 0, 1


class Antennas(NamedTuple):
    """Where the antennas of k anchors are and what they reach.

    places: (k, 3) east, north, altitude, metres; where distant (k,) bool is set, the unit direction towards it.
    limits: (k,) of LIMIT_FIELDS, which count where limited (k,) bool is set. drop_per_m2: of the ground's curvature.
    """

    places: Any
    distant: Any
    limits: Any
    limited: Any
    drop_per_m2: float


class Surfaces(NamedTuple):
    """Over every post: altitude_m, hidden_below_m (anchors, rows, cols), ground_m (rows, cols), float32."""

    altitude_m: Any
    hidden_below_m: Any
    ground_m: Any


class Window(NamedTuple):
    """Some posts of a grid: the frame of the grid, metres, and the window's first row and column."""

    origin_east_m: float
    origin_north_m: float
    cell_east_m: float
    cell_north_m: float
    first_row: int
    first_col: int


@scalar_kernel
def _triangle(rows, cols, row, col):
    """(three posts, their weights) of the triangle around a fractional position within the grid."""
    top = min(int(row), max(rows - 2, 0))
    left = min(int(col), max(cols - 2, 0))
    bottom, right = min(top + 1, rows - 1), min(left + 1, cols - 1)
    down, across = row - top, col - left
    if down >= across:
        return ((top, left), (bottom, left), (bottom, right)), (1.0 - down, down - across, across)
    return ((top, left), (top, right), (bottom, right)), (1.0 - across, across - down, down)


@scalar_kernel
def _between(surface_m, corners, weights):
    """Linear between three posts of a surface (rows, cols); a post without weight does not count.

    An infinite post makes the whole infinite, +inf before -inf, and NaN before both.
    """
    value_m, above, below = 0.0, False, False
    for i in range(3):
        if weights[i] > 0.0:
            row, col = corners[i]
            post_m = float(surface_m[row, col])
            if post_m == math.inf:
                above = True
            elif post_m == -math.inf:
                below = True
            else:
                value_m += weights[i] * post_m
    if math.isnan(value_m):
        return value_m
    if above:
        return math.inf
    return -math.inf if below else value_m


@scalar_kernel
def _is_reached(point, place, limits, drop_per_m2):
    """Whether a point is neither above what an antenna reaches nor too near; the rest is in the surfaces."""
    east, north, up = point[0] - place[0], point[1] - place[1], point[2]
    away = math.hypot(east, north)
    rise = up - drop_per_m2 * away * away - place[2]
    too_near, top = upper_bounds(away, limits)
    return rise <= top and abs(rise) >= too_near


@parallel_kernel
def sets_at_points(points_m, posts, surfaces, antennas, mask, unknown):
    """Fill mask (n, words) uint64 with visible sets, and unknown (n,) with whether any anchor's visibility is unknown.

    points_m: (n, 3) east, north, altitude; posts: (n, 2) fractional row and column. surfaces: Surfaces; antennas:
    Antennas. A point outside the grid, or with a NaN, is unknown.
    """
    altitude_m, hidden_below_m = surfaces.altitude_m, surfaces.hidden_below_m
    _, rows, cols = altitude_m.shape
    for i in prange(points_m.shape[0]):
        mask[i, :] = np.uint64(0)
        unknown[i] = False
        row, col = settled(posts[i, ROW]), settled(posts[i, COL])
        point = (points_m[i, 0], points_m[i, 1], points_m[i, 2])
        inside = row >= 0.0 and row <= rows - 1 and col >= 0.0 and col <= cols - 1
        if not inside or math.isnan(point[2]):
            unknown[i] = True
            continue
        corners, weights = _triangle(rows, cols, row, col)
        for a in range(antennas.places.shape[0]):
            if point[2] < _between(hidden_below_m[a], corners, weights):
                continue
            bounded = antennas.limited[a] and not antennas.distant[a]
            if bounded and not _is_reached(point, antennas.places[a], antennas.limits[a], antennas.drop_per_m2):
                continue
            sure_m = _between(altitude_m[a], corners, weights)
            if math.isnan(sure_m):
                unknown[i] = True
            elif point[2] >= sure_m:
                mask[i, a >> 6] |= np.uint64(1) << np.uint64(a & 63)
