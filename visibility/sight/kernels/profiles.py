"""The ground under a straight line in order, and what needs that order: Fresnel zones and the way over the ground."""

import math

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel
from visibility.sight.kernels.crossings import (
    GRAZING_TOLERANCE_M,
    NEGLIGIBLE,
    clip_to_grid,
    crossing,
    end_ground,
    families,
    is_inside,
)

__all__ = ["DETOUR", "ZONE", "ground_profile", "over_profiles"]

# What to work out for a line, as bits.
ZONE = 1
DETOUR = 2


@scalar_kernel
def ground_profile(heights_m, cells_m, drop_per_m2, ends, profile):
    """Fill profile (m, 3) with (t, ground height, clearance) in order of t, the ends included; returns how many rows.

    ends: two (row, col, altitude). The profile needs 2·(rows + cols) + 2 rows at most. Height and clearance are NaN on
    unknown ground; parts outside the grid have no rows.
    """
    start, end = ends
    step = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    reach_m2 = (step[1] * cells_m[0]) ** 2 + (step[0] * cells_m[1]) ** 2
    flat_m = heights_m.ravel()
    within = clip_to_grid(heights_m.shape, start, step)
    by_row, by_col, diagonal = families(heights_m.shape, cells_m, start, step, within)
    n = 0
    if is_inside(heights_m.shape, start[0], start[1]):
        ground_m, bulge_m2 = end_ground(heights_m, cells_m, start[0], start[1])
        profile[0, 0], profile[0, 1] = 0.0, ground_m
        profile[0, 2] = start[2] - ground_m + drop_per_m2 * bulge_m2
        n = 1
    i, j, k = 0, 0, 0
    while True:
        at_row = by_row[1][0] + i * by_row[1][1] if i < by_row[0][0] else math.inf
        at_col = by_col[1][0] + j * by_col[1][1] if j < by_col[0][0] else math.inf
        at_diagonal = diagonal[1][0] + k * diagonal[1][1] if k < diagonal[0][0] else math.inf
        if at_row == math.inf and at_col == math.inf and at_diagonal == math.inf:
            break
        if at_row <= at_col and at_row <= at_diagonal:
            t, ground_m, bulge_m2 = crossing(flat_m, by_row[0], by_row[1], i)
            i += 1
        elif at_col <= at_diagonal:
            t, ground_m, bulge_m2 = crossing(flat_m, by_col[0], by_col[1], j)
            j += 1
        else:
            t, ground_m, bulge_m2 = crossing(flat_m, diagonal[0], diagonal[1], k)
            k += 1
        profile[n, 0], profile[n, 1] = t, ground_m
        raised_m = drop_per_m2 * (reach_m2 * t * (1.0 - t) - bulge_m2)
        profile[n, 2] = start[2] + t * step[2] - ground_m - raised_m
        n += 1
    if is_inside(heights_m.shape, end[0], end[1]):
        ground_m, bulge_m2 = end_ground(heights_m, cells_m, end[0], end[1])
        profile[n, 0], profile[n, 1] = 1.0, ground_m
        profile[n, 2] = end[2] - ground_m + drop_per_m2 * bulge_m2
        n += 1
    return n


@scalar_kernel
def _least_of_zone(profile, n):
    """Least clearance / sqrt(t(1-t)) over a profile, between its crossings too; +inf without known ground."""
    least = math.inf
    for i in range(n):
        t, above_m = profile[i, 0], profile[i, 2]
        room = t * (1.0 - t)
        if room > NEGLIGIBLE:
            least = min(least, above_m / math.sqrt(room)) if above_m == above_m else least
        elif above_m <= 0.0:
            # the zone closes at its ends, so an end on the ground touches it and one below lies outside any zone
            least = min(least, 0.0 if above_m >= -GRAZING_TOLERANCE_M else -math.inf)
        if i > 0 and t - profile[i - 1, 0] > NEGLIGIBLE:
            slope = (above_m - profile[i - 1, 2]) / (t - profile[i - 1, 0])
            at_start = above_m - slope * t
            turn = at_start / (2.0 * at_start + slope)
            if profile[i - 1, 0] < turn < t:
                least = min(least, (at_start + slope * turn) / math.sqrt(turn * (1.0 - turn)))
    return least


@scalar_kernel
def _detour_m(profile, n, reach_m, rise_m, hull):
    """How much longer a taut string over the ground is than the line itself; +inf where an end lies below the ground.

    hull: (n + 2, 2) scratch for the string's corners as (t, height over the line).
    """
    for i in range(n):
        if profile[i, 2] < -GRAZING_TOLERANCE_M and not NEGLIGIBLE < profile[i, 0] < 1.0 - NEGLIGIBLE:
            return math.inf
    length_m = math.hypot(reach_m, rise_m)
    if length_m == 0.0:
        return 0.0
    hull[0, 0], hull[0, 1] = 0.0, 0.0
    size = 1
    for i in range(n + 1):
        t, over_m = (profile[i, 0], -profile[i, 2]) if i < n else (1.0, 0.0)
        if math.isnan(over_m) or (i < n and not NEGLIGIBLE < t < 1.0 - NEGLIGIBLE):
            continue
        while size > 1:
            before_t, before_m = hull[size - 2, 0], hull[size - 2, 1]
            bend = (hull[size - 1, 0] - before_t) * (over_m - before_m)
            if bend < (t - before_t) * (hull[size - 1, 1] - before_m):
                break
            size -= 1
        hull[size, 0], hull[size, 1] = t, over_m
        size += 1
    detour_m = 0.0
    for i in range(1, size):
        share = hull[i, 0] - hull[i - 1, 0]
        bump_m = hull[i, 1] - hull[i - 1, 1]
        # along and across the line; written so that a small detour is not the difference of two long lengths
        along_m = share * length_m + bump_m * rise_m / length_m
        across_m = bump_m * reach_m / length_m
        leg_m = math.hypot(along_m, across_m)
        detour_m += across_m * across_m / (leg_m + along_m) if along_m > 0.0 else leg_m - along_m
    return detour_m


@scalar_kernel
def _over_profile(heights_m, cells_m, drop_per_m2, start, end, wanted):
    """(zone, detour) of one line, each 0 where it is not wanted."""
    rows, cols = heights_m.shape
    profile = np.zeros((2 * (rows + cols) + 4, 3))
    n = ground_profile(heights_m, cells_m, drop_per_m2, (start, end), profile)
    zone_m = _least_of_zone(profile, n) if wanted & ZONE else 0.0
    if not wanted & DETOUR:
        return zone_m, 0.0
    reach_m = math.hypot((end[1] - start[1]) * cells_m[0], (end[0] - start[0]) * cells_m[1])
    # seen from the middle of the line both ends are lowered alike, so the way there and back are equally long
    return zone_m, _detour_m(profile, n, reach_m, end[2] - start[2], np.zeros((n + 2, 2)))


@parallel_kernel
def over_profiles(heights_m, cells_m, drop_per_m2, start, end, wanted, zone_m, detour_m):
    """Fill zone_m (n,) and detour_m (n,) for lines from start to end, (n, 3) as (row, col, altitude).

    wanted: (n,) uint8, ZONE and DETOUR bits; a line without any keeps what is there.
    zone_m: least clearance / sqrt(t(1-t)). detour_m: extra length of the shortest way over the ground.
    """
    for i in prange(start.shape[0]):
        if wanted[i] > 0:
            first, last = (start[i, 0], start[i, 1], start[i, 2]), (end[i, 0], end[i, 1], end[i, 2])
            found = _over_profile(heights_m, cells_m, drop_per_m2, first, last, wanted[i])
            zone_m[i] = found[0]
            detour_m[i] = found[1]
