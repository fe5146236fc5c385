"""Fast mode: the column-wise O(N) sweep (De Vivo, Battipede, Gili, II-B, eqs. 10-11) over a grid of posts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from .kernels import sweep as kernel
from .sectors import Eye, share_out

__all__ = ["sweep"]

# An eye this close to a line of posts, in cells, is put on it: float32 slopes over less are noise.
SNAP_CELLS = 1e-3


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
    snapped = [(_snap(row), _snap(col), altitude_m) for row, col, altitude_m in eyes]
    work = share_out(snapped, (rows, cols), drop_per_step2_m, kernel.BLOCK_RAYS)
    kernel.sweep(heights_m, out_m, work.tasks, work.reals, work.bins)
    for number, (row, col, _) in enumerate(snapped):
        if row.is_integer() and col.is_integer() and 0 <= row < rows and 0 <= col < cols:
            out_m[number, int(row), int(col)] = heights_m[int(row), int(col)]


def _snap(index: float) -> float:
    return float(round(index)) if abs(index - round(index)) < SNAP_CELLS else index
