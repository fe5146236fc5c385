"""How far lines run through canopy: it is triangulated as the ground is, so between crossings all is straight."""

import math

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel
from visibility.sight.kernels.crossings import grid_point
from visibility.sight.kernels.profiles import CLEARANCE, GROUND, SHARE, ground_profile, profile_room

__all__ = ["canopy_shares"]

# layers over the posts
SOIL, TOP, BASE = 0, 1, 2


@scalar_kernel
def _below(here, there, near, far):
    """The part (near, far) of 0..1 in which what goes evenly from here to there is <= 0; empty where near > far."""
    if here <= 0.0 and there <= 0.0:
        return near, far
    if here > 0.0 and there > 0.0:
        return 1.0, 0.0
    zero = here / (here - there)
    return (near, min(far, zero)) if here <= 0.0 else (max(near, zero), far)


@scalar_kernel
def _share(ground, tops, bases, n):
    """The share of a line over n places at which it is above the bases and below the tops; NaN beside unknown posts."""
    total = 0.0
    for i in range(1, n):
        step = ground[i, SHARE] - ground[i - 1, SHARE]
        if step <= 0.0:
            continue
        top_here, top_there = tops[i - 1, GROUND], tops[i, GROUND]
        if top_here == 0.0 and top_there == 0.0:
            continue
        here, there = ground[i - 1, CLEARANCE], ground[i, CLEARANCE]
        near, far = _below(here - top_here, there - top_there, 0.0, 1.0)
        near, far = _below(bases[i - 1, GROUND] - here, bases[i, GROUND] - there, near, far)
        if far > near:
            total += step * (far - near)
        elif math.isnan(here + there + top_here + top_there):
            return math.nan
    return total


@parallel_kernel
def canopy_shares(layers, cells_m, drop_per_m2, start, end, shares):
    """Fill shares (n,) with how much of each line from start to end, (n, 3) row, col, altitude, runs through canopy.

    layers: (3, rows, cols) float32, altitude of the ground, and over it tops and bases of the canopy, metres.
    """
    room = profile_room(layers.shape[1], layers.shape[2])
    for i in prange(start.shape[0]):
        first, last = grid_point(start, i), grid_point(end, i)
        ground, tops, bases = np.zeros((room, 3)), np.zeros((room, 3)), np.zeros((room, 3))
        n = ground_profile(layers[SOIL], cells_m, drop_per_m2, first, last, ground)
        ground_profile(layers[TOP], cells_m, 0.0, first, last, tops)
        ground_profile(layers[BASE], cells_m, 0.0, first, last, bases)
        shares[i] = _share(ground, tops, bases, n)
