"""The two modes over a grid of posts: fast, the column-wise O(N) sweep, and exact, the horizon over every edge.

The fast sweep is that of De Vivo, Battipede and Gili, II-B, eqs. 10-11; both answer for the same surface.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from compiled.read_only import read_only
from visibility.sight.kernels import exact, sweep
from visibility.sight.kernels.turning import CACHE_LINE, turn
from visibility.sight.sectors import Eye, share_out, snapped, write_own_posts

__all__ = ["MANY_EYES", "exact_sweep", "fast_sweep"]

MANY_EYES = 4  # from here on a turned copy of the grid is cheaper than turning tiles of it for each eye
FAST_SNAP_CELLS = 1e-3  # float32 heights over less make slopes of noise
HIGHEST_OVERHEAD_M = 100_000.0  # from here on float32 slopes are good to centimetres only
EXACT_SNAP_CELLS = 1e-6  # as terrain.height_at: an eye on the ground and the ground beneath it move together


def exact_sweep(
    heights_m: npt.NDArray[np.float32],
    eyes: Sequence[Eye],
    drop_per_step2_m: tuple[float, float],
    out_m: npt.NDArray[np.float32],
) -> None:
    """Fill out_m (n_eyes, rows, cols) with the exact altitude that clears the surface between each post and each eye.

    heights_m: (rows, cols), at least 2 x 2. drop_per_step2_m: curvature drop in metres per squared row step and per
    squared column step.
    """
    eyes, heights_m = snapped(eyes, EXACT_SNAP_CELLS), read_only(heights_m)
    work = share_out(eyes, heights_m, drop_per_step2_m, exact.BLOCK_POSTS)
    turned_m = np.empty(heights_m.shape[::-1], np.float32)
    turn(heights_m, turned_m)
    exact.sweep(heights_m, read_only(turned_m), out_m, work.blocks, work.bins)
    write_own_posts(heights_m, eyes, out_m)


def fast_sweep(
    heights_m: npt.NDArray[np.float32],
    eyes: Sequence[Eye],
    drop_per_step2_m: tuple[float, float],
    out_m: npt.NDArray[np.float32],
) -> None:
    """Fill out_m (n_eyes, rows, cols) with the altitude that clears the ground between each post and each eye.

    heights_m: (rows, cols), at least 2 x 2. drop_per_step2_m: curvature drop in metres per squared row step and per
    squared column step. An eye straight over the map in the height of satellites is answered exactly instead.
    """
    eyes, heights_m = snapped(eyes, FAST_SNAP_CELLS), read_only(heights_m)
    blank_m = read_only(np.full(max(heights_m.shape), np.nan, np.float32))
    turned_m = np.empty((0, 0), np.float32)
    if len(eyes) >= MANY_EYES:
        turned_m = np.empty(heights_m.shape[::-1], np.float32)
        turn(heights_m, turned_m)
    start = 0
    for overhead, run in itertools.groupby(eyes, key=lambda eye: _overhead(eye, heights_m.shape)):
        some = list(run)
        part_m = out_m[start : start + len(some)]
        start += len(some)
        if overhead:
            exact_sweep(heights_m, some, drop_per_step2_m, part_m)
        else:
            work = share_out(some, heights_m, drop_per_step2_m, sweep.BLOCK_RAYS, follow_borders=True)
            shift = part_m.ctypes.data // part_m.itemsize % CACHE_LINE
            sweep.sweep(heights_m, read_only(turned_m), blank_m, part_m, work.blocks, work.bins, shift)
    write_own_posts(heights_m, eyes, out_m)


def _overhead(eye: Eye, shape: tuple[int, ...]) -> bool:
    row, col, altitude_m = eye
    return altitude_m > HIGHEST_OVERHEAD_M and -1 <= row <= shape[0] and -1 <= col <= shape[1]
