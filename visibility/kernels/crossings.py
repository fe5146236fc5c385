"""Kernels of the straight line over the triangulation: which edges it crosses, and how far above the ground it is there.

A line is ``start`` + t·``step`` with t in 0..1, both (row, col, altitude). Its edges come in three families of parallel
grid lines (rows, columns, diagonals); a line meets each family at equal steps of t, so crossing k needs no search.

Curvature: lowering every post by c·d² and triangulating makes the ground at a point d away c·(d² - bulge) lower, where
bulge = f(1-f)·edge² comes from interpolating a parabola. Measured against the equally lowered line, the ground then
stands c·(t(1-t)·D² - bulge) higher than on a flat body, which reads the same from both ends.
"""

import math

import numpy as np
from numba import njit, prange

__all__ = ["OUTSIDE", "UNKNOWN_GROUND", "clip_to_grid", "crossing", "end_ground", "families", "scan_lines"]

# A weight this small, in edges, is a rounding of "not at all": a post so little involved need not be known.
NEGLIGIBLE = 1e-9

# What happened to a line, as bits.
UNKNOWN_GROUND = 1
OUTSIDE = 2


@njit(cache=True, error_model="numpy")
def _clip_axis(last, start, step, near, far):
    """The part of near..far in which start + t·step stays within 0..last; empty (near > far) where it never does."""
    low, high = -NEGLIGIBLE - start, last + NEGLIGIBLE - start
    if step == 0.0:
        return (near, far) if low <= 0.0 <= high else (1.0, 0.0)
    first, second = low / step, high / step
    return max(near, min(first, second)), min(far, max(first, second))


@njit(cache=True, error_model="numpy")
def clip_to_grid(rows, cols, start, step):
    """The part (near, far) of t in which a line is over the grid; near > far where it misses it.

    A single row or column of posts extends sideways, so it does not clip in that direction.
    """
    near, far = 0.0, 1.0
    if rows > 1:
        near, far = _clip_axis(rows - 1.0, start[0], step[0], near, far)
    if cols > 1:
        near, far = _clip_axis(cols - 1.0, start[1], step[1], near, far)
    return near, far


@njit(cache=True, error_model="numpy")
def _steps(value, step, near, far, low, high):
    """Whole numbers low..high that value + t·step passes for t in near..far: how many, the first, the direction."""
    # a line that drifts less than this along the family runs beside its lines; the other families hold its profile
    if not abs(step) > NEGLIGIBLE or near > far:
        return 0, 0, 1
    at_near, at_far = value + near * step, value + far * step
    if step > 0.0:
        first, last, direction = math.ceil(at_near), math.floor(at_far), 1
        first, last = max(first, low), min(last, high)
    else:
        first, last, direction = math.floor(at_near), math.ceil(at_far), -1
        first, last = min(first, high), max(last, low)
    return max((last - first) * direction + 1, 0), first, direction


@njit(cache=True, error_model="numpy")
def families(shape, cells_m, start, step, near, far):
    """The three families of grid lines that a line crosses between near and far: rows, columns, diagonals.

    Each is (counts, places): counts = (crossings, first line, direction, stride along the line, stride between lines,
    last edge along the line, skew, last edge along a skewed line); places = (t of the first crossing, step of t,
    position along the line there, its step, squared length of an edge in m²). See ``crossing``.
    """
    rows, cols = shape
    east2 = cells_m[0] * cells_m[0] if cols > 1 else 0.0
    north2 = cells_m[1] * cells_m[1] if rows > 1 else 0.0
    r, c = start[0], start[1]
    dr, dc = step[0], step[1]
    far_col, far_row = max(cols - 2, 0), max(rows - 2, 0)

    n, line, way = _steps(r, dr, near, far, 0, rows - 1) if rows > 1 else (0, 0, 1)
    t, dt = ((line - r) / dr, way / dr) if n > 0 else (0.0, 0.0)
    by_row = ((n, line, way, 1, cols, far_col, 0, far_col), (t, dt, c + t * dc, dt * dc, east2))

    n, line, way = _steps(c, dc, near, far, 0, cols - 1) if cols > 1 else (0, 0, 1)
    t, dt = ((line - c) / dc, way / dc) if n > 0 else (0.0, 0.0)
    by_col = ((n, line, way, cols, 1, far_row, 0, far_row), (t, dt, r + t * dr, dt * dr, north2))

    n, line, way = _steps(r - c, dr - dc, near, far, 2 - cols, rows - 2) if rows > 1 and cols > 1 else (0, 0, 1)
    t, dt = ((line - (r - c)) / (dr - dc), way / (dr - dc)) if n > 0 else (0.0, 0.0)
    diagonal = ((n, line, way, cols + 1, -1, far_row, 1, far_col), (t, dt, r + t * dr, dt * dr, east2 + north2))
    return by_row, by_col, diagonal


@njit(cache=True, error_model="numpy")
def crossing(flat_m, counts, places, k):
    """Crossing k of a family: (t, ground height in metres or NaN where unknown, bulge in m²).

    flat_m: heights (rows·cols,). The position along the grid line is clamped to its edges, so that rounding at the
    border never reads beside the grid.
    """
    line = counts[1] + k * counts[2]
    t = places[0] + k * places[1]
    position = places[2] + k * places[3]
    skew = counts[6] * line
    edge = min(max(int(position), max(skew, 0)), min(counts[5], skew + counts[7]))
    fraction = position - edge
    here = edge * counts[3] + line * counts[4]
    beyond = here + counts[3] if counts[5] + counts[7] + fraction != math.inf else here
    return t, fraction, here, beyond
