"""Visible sets at points anywhere over the grid, from minimum visible altitudes at its posts."""

import math

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel
from terrain.kernels import settled
from visibility.sight.kernels.reach import upper_bounds

__all__ = ["sets_at_points"]


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
def _between(surface_m, posts, weights):
    """Linear between three posts of a surface (rows, cols); a post without weight does not count.

    An infinite post makes the whole infinite, +inf before -inf, and NaN before both.
    """
    value_m, above, below = 0.0, False, False
    for i in range(3):
        if weights[i] > 0.0:
            post_m = float(surface_m[posts[i][0], posts[i][1]])
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
def _is_reached(point, anchor, limits, drop_per_m2):
    """Whether a point is neither above what an antenna reaches nor too near; the rest is in the surfaces."""
    away = math.hypot(point[0] - anchor[0], point[1] - anchor[1])
    rise = point[2] - drop_per_m2 * away * away - anchor[2]
    too_near, top = upper_bounds(away, limits)
    return rise <= top and abs(rise) >= too_near


@parallel_kernel
def sets_at_points(points_m, posts, surfaces, reach, mask, unknown):
    """Fill mask (n, words) uint64 with visible sets, and unknown (n,) with whether any anchor's visibility is unknown.

    points_m: (n, 3) east, north, altitude; posts: (n, 2) fractional row and column. surfaces: (altitude_m,
    hidden_below_m), each (anchors, rows, cols). reach: (anchors (k, 3), distant (k,), limits (k, 6), limited (k,),
    drop_per_m2). A point outside the grid, or with a NaN, is unknown.
    """
    altitude_m, hidden_below_m = surfaces
    anchors, distant, limits, limited, drop_per_m2 = reach
    rows, cols = altitude_m.shape[1], altitude_m.shape[2]
    for i in prange(points_m.shape[0]):
        mask[i, :] = np.uint64(0)
        unknown[i] = False
        row, col = settled(posts[i, 0]), settled(posts[i, 1])
        point = (points_m[i, 0], points_m[i, 1], points_m[i, 2])
        inside = row >= 0.0 and row <= rows - 1 and col >= 0.0 and col <= cols - 1
        if not inside or math.isnan(point[2]):
            unknown[i] = True
            continue
        corners, weights = _triangle(rows, cols, row, col)
        for a in range(anchors.shape[0]):
            if point[2] < _between(hidden_below_m[a], corners, weights):
                continue
            if limited[a] and not distant[a]:
                anchor = (anchors[a, 0], anchors[a, 1], anchors[a, 2])
                if not _is_reached(point, anchor, limits[a], drop_per_m2):
                    continue
            sure_m = _between(altitude_m[a], corners, weights)
            if math.isnan(sure_m):
                unknown[i] = True
            elif point[2] >= sure_m:
                mask[i, a >> 6] |= np.uint64(1) << np.uint64(a & 63)
