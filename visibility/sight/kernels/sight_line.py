"""The least clearance of a straight line over the triangulation, for many lines at once."""

import math

import numpy as np
from numba import float64, int32, int64, prange, uint64

from compiled.options import inner_loop, parallel_kernel, scalar_kernel
from visibility.sight.kernels.crossings import clip_to_grid, crossing, end_ground, families, is_inside

__all__ = ["LEAVES_GRID", "OVER_UNKNOWN", "scan_lines"]

# What else happened to a line, as bits.
OVER_UNKNOWN = 1
LEAVES_GRID = 2

STRETCH = 256  # crossings looked at in one go; their clearances stay in the nearest cache
BLOCK = 64  # lines that one thread takes at a time


@inner_loop
def _clearances(flat_m, first, out_m, counts, places, line):
    """Fill out_m with the clearances over crossings first, first + 1 … of a family; NaN beside any unknown post.

    counts, places: see ``families``; line: see ``_scan_family``. The same numbers as ``crossing``, in a loop that the
    processor can do several of at once.
    """
    number, direction, stride, between, last, skew, skew_last, to_far_end = counts
    t_0, dt, position_0, d_position, edge2 = places
    altitude_m, rise_m, sag_m, drop_per_m2 = line
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
def _scan_family(flat_m, family, line, least, stretch_m):
    """((clearance, t, ground), unknown): the least of one family's crossings and of what was found before it.

    line: (altitude at t = 0, rise to t = 1, c·D², c). Of equal clearances the nearer one stays.
    """
    counts, places = family
    altitude_m, rise_m, sag_m, drop_per_m2 = line
    numbers = (
        int32(counts[1]),
        int32(counts[2]),
        int32(counts[3]),
        int32(counts[4]),
        int32(counts[5]),
        int32(counts[6]),
        int32(counts[7]),
        int32(counts[8]),
    )  # 32 bits, so that more of them fit into one instruction
    clearance_m, best = math.inf, -1
    unknown = False
    for first in range(0, counts[0], STRETCH):
        n = min(STRETCH, counts[0] - first)
        _clearances(flat_m, int32(first), stretch_m[:n], numbers, places, line)
        for i in range(n):
            above_m = stretch_m[i]
            if above_m < clearance_m:
                clearance_m, best = above_m, first + i
            elif math.isnan(above_m):
                # beside an unknown post; known all the same where the line passes straight over the edge's other end
                t, ground_m, bulge_m2 = crossing(flat_m, counts, places, first + i)
                above_m = altitude_m + t * rise_m - ground_m - (sag_m * t * (1.0 - t) - drop_per_m2 * bulge_m2)
                if above_m < clearance_m:
                    clearance_m, best = above_m, first + i
                unknown = unknown or math.isnan(above_m)
    if best >= 0:
        t, ground_m, _ = crossing(flat_m, counts, places, best)
        if clearance_m < least[0] or (clearance_m == least[0] and t < least[1]):
            return (clearance_m, t, ground_m), unknown
    return least, unknown


@scalar_kernel
def _scan_line(heights_m, cells_m, drop_per_m2, ends, stretch_m):
    """((clearance, t, ground), bits) of the line between two (row, col, altitude) ends."""
    start, end = ends
    flat_m = heights_m.ravel()
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
    least, unknown_row = _scan_family(flat_m, by_row, line, least, stretch_m)
    least, unknown_col = _scan_family(flat_m, by_col, line, least, stretch_m)
    least, unknown_diagonal = _scan_family(flat_m, diagonal, line, least, stretch_m)
    if unknown_row or unknown_col or unknown_diagonal:
        bits |= OVER_UNKNOWN
    return least, bits


@parallel_kernel
def scan_lines(heights_m, cells_m, drop_per_m2, start, end, least, bits):
    """Fill least (n, 3) with (clearance_m, t, ground height) and bits (n,) for lines from start to end.

    heights_m: (rows, cols) C-contiguous; cells_m: (east, north); start, end: (n, 3) as (row, col, altitude).
    Where a line meets no known ground: clearance +inf, t and ground NaN.
    """
    n = start.shape[0]
    for block in prange((n + BLOCK - 1) // BLOCK):
        stretch_m = np.zeros(STRETCH)
        for i in range(block * BLOCK, min((block + 1) * BLOCK, n)):
            ends = ((start[i, 0], start[i, 1], start[i, 2]), (end[i, 0], end[i, 1], end[i, 2]))
            found, what = _scan_line(heights_m, cells_m, drop_per_m2, ends, stretch_m)
            least[i, 0] = found[0]
            least[i, 1] = found[1] if found[0] < math.inf else np.nan
            least[i, 2] = found[2]
            bits[i] = what
