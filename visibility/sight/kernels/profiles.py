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
    grid_point,
    is_inside,
    step_between,
)

__all__ = ["DETOUR", "ZONE", "ground_profile", "over_profiles", "profile_room"]

# What to work out for a line, as bits.
ZONE = 1
DETOUR = 2

# columns of a profile: t, ground height, clearance; of a taut string's corners: t, height over the line
SHARE, GROUND, CLEARANCE = 0, 1, 2
HEIGHT = 1


@scalar_kernel
def profile_room(rows, cols):
    """How many rows a profile over so large a grid needs at most."""
    return 2 * (rows + cols) + 4


@scalar_kernel
def _put(profile, n, t, ground_m, clearance_m):
    """Write row n of a profile; returns the next."""
    profile[n, SHARE], profile[n, GROUND], profile[n, CLEARANCE] = t, ground_m, clearance_m
    return n + 1


@scalar_kernel
def _t_of(family, k):
    """Where on a line crossing k of a Family is; +inf after the last."""
    return family.t_0 + k * family.dt if k < family.crossings else math.inf


@scalar_kernel
def ground_profile(heights_m, cells_m, drop_per_m2, start, end, profile):
    """Fill profile (``profile_room``, 3) with SHARE, GROUND and CLEARANCE in order of t; returns how many rows.

    start, end: GridPoints, which are in it. Height and clearance are NaN on unknown ground; parts outside the grid have
    no rows.
    """
    cell_east_m, cell_north_m = cells_m
    step = step_between(start, end)
    reach_m2 = (step.col * cell_east_m) ** 2 + (step.row * cell_north_m) ** 2
    flat_m = heights_m.ravel()
    within = clip_to_grid(heights_m.shape, start, step)
    by_row, by_col, diagonal = families(heights_m.shape, cells_m, start, step, within)
    n = 0
    if is_inside(heights_m.shape, start.row, start.col):
        ground_m, bulge_m2 = end_ground(heights_m, cells_m, start.row, start.col)
        n = _put(profile, n, 0.0, ground_m, start.altitude_m - ground_m + drop_per_m2 * bulge_m2)
    i, j, k = 0, 0, 0
    while True:
        at_row, at_col, at_diagonal = _t_of(by_row, i), _t_of(by_col, j), _t_of(diagonal, k)
        if at_row == math.inf and at_col == math.inf and at_diagonal == math.inf:
            break
        if at_row <= at_col and at_row <= at_diagonal:
            t, ground_m, bulge_m2 = crossing(flat_m, by_row, i)
            i += 1
        elif at_col <= at_diagonal:
            t, ground_m, bulge_m2 = crossing(flat_m, by_col, j)
            j += 1
        else:
            t, ground_m, bulge_m2 = crossing(flat_m, diagonal, k)
            k += 1
        raised_m = drop_per_m2 * (reach_m2 * t * (1.0 - t) - bulge_m2)
        n = _put(profile, n, t, ground_m, start.altitude_m + t * step.altitude_m - ground_m - raised_m)
    if is_inside(heights_m.shape, end.row, end.col):
        ground_m, bulge_m2 = end_ground(heights_m, cells_m, end.row, end.col)
        n = _put(profile, n, 1.0, ground_m, end.altitude_m - ground_m + drop_per_m2 * bulge_m2)
    return n


@scalar_kernel
def _least_of_zone(profile, n):
    """Least clearance / sqrt(t(1-t)) over a profile, between its crossings too; +inf without known ground."""
    least = math.inf
    for i in range(n):
        t, above_m = profile[i, SHARE], profile[i, CLEARANCE]
        room = t * (1.0 - t)
        if room > NEGLIGIBLE:
            least = min(least, above_m / math.sqrt(room)) if above_m == above_m else least
        elif above_m <= 0.0:
            # the zone closes at its ends, so an end on the ground touches it and one below lies outside any zone
            least = min(least, 0.0 if above_m >= -GRAZING_TOLERANCE_M else -math.inf)
        if i > 0 and t - profile[i - 1, SHARE] > NEGLIGIBLE:
            slope = (above_m - profile[i - 1, CLEARANCE]) / (t - profile[i - 1, SHARE])
            at_start = above_m - slope * t
            turn = at_start / (2.0 * at_start + slope)
            if profile[i - 1, SHARE] < turn < t:
                least = min(least, (at_start + slope * turn) / math.sqrt(turn * (1.0 - turn)))
    return least


@scalar_kernel
def _detour_m(profile, n, reach_m, rise_m, hull):
    """How much longer a taut string over the ground is than the line itself; +inf where an end lies below the ground.

    hull: (n + 2, 2) scratch for the string's corners, SHARE and HEIGHT.
    """
    for i in range(n):
        if profile[i, CLEARANCE] < -GRAZING_TOLERANCE_M and not NEGLIGIBLE < profile[i, SHARE] < 1.0 - NEGLIGIBLE:
            return math.inf
    length_m = math.hypot(reach_m, rise_m)
    if length_m == 0.0:
        return 0.0
    hull[0, SHARE], hull[0, HEIGHT] = 0.0, 0.0
    size = 1
    for i in range(n + 1):
        t, over_m = (profile[i, SHARE], -profile[i, CLEARANCE]) if i < n else (1.0, 0.0)
        if math.isnan(over_m) or (i < n and not NEGLIGIBLE < t < 1.0 - NEGLIGIBLE):
            continue
        while size > 1:
            before_t, before_m = hull[size - 2, SHARE], hull[size - 2, HEIGHT]
            bend = (hull[size - 1, SHARE] - before_t) * (over_m - before_m)
            if bend < (t - before_t) * (hull[size - 1, HEIGHT] - before_m):
                break
            size -= 1
        hull[size, SHARE], hull[size, HEIGHT] = t, over_m
        size += 1
    detour_m = 0.0
    for i in range(1, size):
        share = hull[i, SHARE] - hull[i - 1, SHARE]
        bump_m = hull[i, HEIGHT] - hull[i - 1, HEIGHT]
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
    cell_east_m, cell_north_m = cells_m
    profile = np.zeros((profile_room(rows, cols), 3))
    n = ground_profile(heights_m, cells_m, drop_per_m2, start, end, profile)
    zone_m = _least_of_zone(profile, n) if wanted & ZONE else 0.0
    if not wanted & DETOUR:
        return zone_m, 0.0
    step = step_between(start, end)
    reach_m = math.hypot(step.col * cell_east_m, step.row * cell_north_m)
    # seen from the middle of the line both ends are lowered alike, so the way there and back are equally long
    return zone_m, _detour_m(profile, n, reach_m, step.altitude_m, np.zeros((n + 2, 2)))


@parallel_kernel
def over_profiles(heights_m, cells_m, drop_per_m2, start, end, wanted, zone_m, detour_m):
    """Fill zone_m (n,) and detour_m (n,) for lines from start to end, (n, 3) as (row, col, altitude).

    wanted: (n,) uint8, ZONE and DETOUR bits; a line without any keeps what is there.
    zone_m: least clearance / sqrt(t(1-t)). detour_m: extra length of the shortest way over the ground.
    """
    for i in prange(start.shape[0]):
        if wanted[i] > 0:
            first, last = grid_point(start, i), grid_point(end, i)
            zone_m[i], detour_m[i] = _over_profile(heights_m, cells_m, drop_per_m2, first, last, wanted[i])
