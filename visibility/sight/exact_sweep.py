"""Exact mode: the horizon over every edge of the triangulated surface, carried outward from the eye."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from compiled.read_only import read_only
from visibility.sight.kernels import exact as kernel
from visibility.sight.kernels.turning import turn
from visibility.sight.sectors import Eye, share_out, snapped, write_own_posts

__all__ = ["sweep"]

SNAP_CELLS = 1e-6  # as terrain.height_at: an eye on the ground and the ground beneath it move together


def sweep(
    heights_m: npt.NDArray[np.float32],
    eyes: Sequence[Eye],
    drop_per_step2_m: tuple[float, float],
    out_m: npt.NDArray[np.float32],
) -> None:
    """Fill out_m (n_eyes, rows, cols) with the exact altitude that clears the surface between each post and each eye.

    heights_m: (rows, cols), at least 2 x 2. drop_per_step2_m: curvature drop in metres per squared row step and per
    squared column step.
    """
    eyes, heights_m = snapped(eyes, SNAP_CELLS), read_only(heights_m)
    work = share_out(eyes, heights_m, drop_per_step2_m, kernel.BLOCK_POSTS)
    turned_m = np.empty(heights_m.shape[::-1], np.float32)
    turn(heights_m, turned_m)
    kernel.sweep(heights_m, read_only(turned_m), out_m, work.blocks, work.bins)
    write_own_posts(heights_m, eyes, out_m)
