"""The least clearance of a straight line over the triangulation, for many lines at once."""

import math
from typing import NamedTuple

import numpy as np
from numba import float64, int32, int64, prange, uint64

from compiled.options import inner_loop, parallel_kernel, scalar_kernel
from visibility.sight.kernels.crossings import (
    Family,
    clip_to_grid,
    crossing,
    end_ground,
    families,
    grid_point,
    is_inside,
    step_between,
)

__all__ = ["LEAVES_GRID", "OVER_UNKNOWN", "scan_few", "scan_lines"]

# What else happened to a line, as bits.
OVER_UNKNOWN = 1
LEAVES_GRID = 2

STRETCH = 256  # crossings looked at in one go; their clearances stay in the nearest cache
BLOCK = 64  # lines that one thread takes at a time


# columns of the table of least clearances
CLEARANCE, SHARE, GROUND = 0, 1, 2


class Sight(NamedTuple):
    """A line over a bulging body: altitude at t = 0, rise to t = 1, c·D², and c of the drop c·d², 1/m."""

    altitude_m: float
    rise_m: float
    sag_m: float
    drop_per_m2: float


class Least(NamedTuple):
    """The least clearance of a line, at which t, and the ground there."""

    clearance_m: float
    t: float
    ground_m: float


@inner_loop
def _clearances(flat_m, first, out_m, family, sight):
    """Fill out_m with the clearances over crossings first, first + 1 … of a Family; NaN beside any unknown post.

    The same numbers as ``crossing``, in a loop that the processor can do several of at once.
    """
    number, direction, stride, between = family.first_line, family.direction, family.stride, family.between
    last, skew, skew_last, to_far_end = family.last_edge, family.skew, family.skew_last, family.to_far_end
    t_0, dt, position_0, d_position = family.t_0, family.dt, family.position_0, family.d_position
    edge2 = family.edge2_m2
    altitude_m, rise_m, sag_m, drop_per_m2 = sight
    nothing = int32(0)
    for i in range(out_m.shape[0]):
        k = first + int32(i)
        step = float64(k)
        grid_line = number + k * direction
        t = t_0 + step * dt
        position = position_0 + step * d_position
        low = skew * grid_line
        edge = min(max(max(int32(position), low), nothing), min(low + skew_last, last))
        fraction = position - float64(edge)
        index = int64(edge) * stride + int64(grid_line) * between
        here = float64(flat_m[uint64(index)])
        there = float64(flat_m[uint64(index + to_far_end)])
        raised_m = sag_m * t * (1.0 - t) - drop_per_m2 * (edge2 * fraction * (1.0 - fraction))
        out_m[i] = altitude_m + t * rise_m - (here + fraction * (there - here)) - raised_m


@scalar_kernel
def _narrowed(family):
    """The same Family with counts of 32 bits, so that more of them fit into one instruction."""
    return Family(
        int32(family.crossings),
        int32(family.first_line),
        int32(family.direction),
        int32(family.stride),
        int32(family.between),
        int32(family.last_edge),
        int32(family.skew),
        int32(family.skew_last),
        int32(family.to_far_end),
        family.t_0,
        family.dt,
        family.position_0,
        family.d_position,
        family.edge2_m2,
    )


@scalar_kernel
def _scan_family(flat_m, family, sight, least, stretch_m):
    """(Least, unknown): of one family's crossings and of what was found before it; of equal ones the nearer stays."""
    altitude_m, rise_m, sag_m, drop_per_m2 = sight
    narrowed = _narrowed(family)
    clearance_m, best = math.inf, -1
    unknown = False
    for first in range(0, family.crossings, STRETCH):
        n = min(STRETCH, family.crossings - first)
        _clearances(flat_m, int32(first), stretch_m[:n], narrowed, sight)
        for i in range(n):
            above_m = stretch_m[i]
            if above_m < clearance_m:
                clearance_m, best = above_m, first + i
            elif math.isnan(above_m):
                # beside an unknown post; known all the same where the line passes straight over the edge's other end
                t, ground_m, bulge_m2 = crossing(flat_m, family, first + i)
                above_m = altitude_m + t * rise_m - ground_m - (sag_m * t * (1.0 - t) - drop_per_m2 * bulge_m2)
                if above_m < clearance_m:
                    clearance_m, best = above_m, first + i
                unknown = unknown or math.isnan(above_m)
    if best >= 0:
        t, ground_m, _ = crossing(flat_m, family, best)
        if clearance_m < least.clearance_m or (clearance_m == least.clearance_m and t < least.t):
            return Least(clearance_m, t, ground_m), unknown
    return least, unknown


@scalar_kernel
def _scan_line(heights_m, cells_m, drop_per_m2, start, end, stretch_m):
    """(Least, bits) of the line between two GridPoints."""
    flat_m = heights_m.ravel()
    cell_east_m, cell_north_m = cells_m
    step = step_between(start, end)
    reach_m2 = (step.col * cell_east_m) ** 2 + (step.row * cell_north_m) ** 2
    least = Least(math.inf, 2.0, math.nan)
    bits = 0
    for t, point in ((0.0, start), (1.0, end)):
        if is_inside(heights_m.shape, point.row, point.col):
            ground_m, bulge_m2 = end_ground(heights_m, cells_m, point.row, point.col)
            above_m = point.altitude_m - ground_m + drop_per_m2 * bulge_m2
            if above_m < least.clearance_m:
                least = Least(above_m, t, ground_m)
            elif math.isnan(above_m):
                bits |= OVER_UNKNOWN
        else:
            bits |= LEAVES_GRID
    within = clip_to_grid(heights_m.shape, start, step)
    sight = Sight(start.altitude_m, step.altitude_m, drop_per_m2 * reach_m2, drop_per_m2)
    by_row, by_col, diagonal = families(heights_m.shape, cells_m, start, step, within)
    least, unknown_row = _scan_family(flat_m, by_row, sight, least, stretch_m)
    least, unknown_col = _scan_family(flat_m, by_col, sight, least, stretch_m)
    least, unknown_diagonal = _scan_family(flat_m, diagonal, sight, least, stretch_m)
    if unknown_row or unknown_col or unknown_diagonal:
        bits |= OVER_UNKNOWN
    return least, bits


@scalar_kernel
def scan_few(heights_m, cells_m, drop_per_m2, start, end, least, bits):
    """The same as ``scan_lines`` on one thread: a few lines are done before another thread would have begun."""
    stretch_m = np.zeros(STRETCH)
    for i in range(start.shape[0]):
        first, last = grid_point(start, i), grid_point(end, i)
        found, what = _scan_line(heights_m, cells_m, drop_per_m2, first, last, stretch_m)
        least[i, CLEARANCE] = found.clearance_m
        least[i, SHARE] = found.t if found.clearance_m < math.inf else np.nan
        least[i, GROUND] = found.ground_m
        bits[i] = what


@parallel_kernel
def scan_lines(heights_m, cells_m, drop_per_m2, start, end, least, bits):
    """Fill least (n, 3) with CLEARANCE, SHARE (t) and GROUND, and bits (n,) for lines from start to end.

    heights_m: (rows, cols) C-contiguous; cells_m: (east, north); start, end: (n, 3) as (row, col, altitude).
    Where a line meets no known ground: clearance +inf, t and ground NaN.
    """
    n = start.shape[0]
    for block in prange((n + BLOCK - 1) // BLOCK):
        of = slice(block * BLOCK, min((block + 1) * BLOCK, n))
        scan_few(heights_m, cells_m, drop_per_m2, start[of], end[of], least[of], bits[of])
