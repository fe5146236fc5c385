"""Fast mode: the column-wise O(N) sweep (De Vivo, Battipede, Gili, II-B, eqs. 10-11) over a grid of posts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from .kernels import sweep as kernel
from .sectors import Eye, share_out, snapped, write_own_posts

__all__ = ["sweep"]

SNAP_CELLS = 1e-3  # float32 heights over less make slopes of noise


def sweep(
    heights_m: npt.NDArray[np.float32],
    eyes: Sequence[Eye],
    drop_per_step2_m: tuple[float, float],
    out_m: npt.NDArray[np.float32],
) -> None:
    """Fill out_m (n_eyes, rows, cols) with the altitude that clears the ground between each post and each eye.

    heights_m: (rows, cols), at least 2 x 2. drop_per_step2_m: curvature drop in metres per squared row step and per
    squared column step.
    """
    rows, cols = heights_m.shape
    eyes = snapped(eyes, SNAP_CELLS)
    work = share_out(eyes, (rows, cols), drop_per_step2_m, kernel.BLOCK_RAYS)
    kernel.sweep(heights_m, out_m, work.tasks, work.reals, work.bins)
    write_own_posts(heights_m, eyes, out_m)
