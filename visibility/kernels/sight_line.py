"""The least clearance of a straight line over the triangulation, for many lines at once."""

import math

import numpy as np
from numba import prange

from terrain.kernel_options import parallel_kernel, scalar_kernel

from .crossings import clip_to_grid, crossing, end_ground, families, is_inside

__all__ = ["LEAVES_GRID", "OVER_UNKNOWN", "scan_lines"]

# What else happened to a line, as bits.
OVER_UNKNOWN = 1
LEAVES_GRID = 2


@scalar_kernel
def _scan_family(flat_m, family, line, least):
    """Least of (clearance, t, ground) over one family's crossings and what was found before; the nearer of equals."""
    counts, places = family
    altitude_m, rise_m, sag_m, drop_per_m2 = line
    clearance_m, at, ground_at_m = math.inf, 0.0, math.nan
    unknown = False
    for k in range(counts[0]):
        t, ground_m, bulge_m2 = crossing(flat_m, counts, places, k)
        above_m = altitude_m + t * rise_m - ground_m - (sag_m * t * (1.0 - t) - drop_per_m2 * bulge_m2)
        if above_m < clearance_m:
            clearance_m, at, ground_at_m = above_m, t, ground_m
        elif math.isnan(above_m):
            unknown = True
    if clearance_m < least[0] or (clearance_m == least[0] and at < least[1]):
        return (clearance_m, at, ground_at_m), unknown
    return least, unknown


@scalar_kernel
def _scan_line(heights_m, flat_m, cells_m, drop_per_m2, ends):
    """((clearance, t, ground), bits) of the line between two (row, col, altitude) ends."""
    start, end = ends
    step = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    reach_m2 = (step[1] * cells_m[0]) ** 2 + (step[0] * cells_m[1]) ** 2
    least = (math.inf, 2.0, math.nan)
    bits = 0
    for t, point in ((0.0, start), (1.0, end)):
        if is_inside(heights_m.shape, point[0], point[1]):
            ground_m, bulge_m2 = end_ground(heights_m, cells_m, point[0], point[1])
            above_m = point[2] - ground_m + drop_per_m2 * bulge_m2
            if above_m < least[0]:
                least = (above_m, t, ground_m)
            elif math.isnan(above_m):
                bits |= OVER_UNKNOWN
        else:
            bits |= LEAVES_GRID
    within = clip_to_grid(heights_m.shape, start, step)
    line = (start[2], step[2], drop_per_m2 * reach_m2, drop_per_m2)
    by_row, by_col, diagonal = families(heights_m.shape, cells_m, start, step, within)
    least, unknown_row = _scan_family(flat_m, by_row, line, least)
    least, unknown_col = _scan_family(flat_m, by_col, line, least)
    least, unknown_diagonal = _scan_family(flat_m, diagonal, line, least)
    if unknown_row or unknown_col or unknown_diagonal:
        bits |= OVER_UNKNOWN
    return least, bits


@parallel_kernel
def scan_lines(heights_m, cells_m, drop_per_m2, start, end, least, bits):
    """Fill least (n, 3) with (clearance_m, t, ground height) and bits (n,) for lines from start to end.

    heights_m: (rows, cols) C-contiguous; cells_m: (east, north); start, end: (n, 3) as (row, col, altitude).
    Where a line meets no known ground: clearance +inf, t and ground NaN.
    """
    flat_m = heights_m.ravel()
    for i in prange(start.shape[0]):
        ends = ((start[i, 0], start[i, 1], start[i, 2]), (end[i, 0], end[i, 1], end[i, 2]))
        found, what = _scan_line(heights_m, flat_m, cells_m, drop_per_m2, ends)
        least[i, 0] = found[0]
        least[i, 1] = found[1] if found[0] < math.inf else np.nan
        least[i, 2] = found[2]
        bits[i] = what
