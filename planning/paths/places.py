"""Places on the ground as fractional posts, and in metres."""

from __future__ import annotations

import itertools
import math

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid

__all__ = ["metres_of", "sampled"]

Floats = npt.NDArray[np.float64]


def metres_of(grid: ElevationGrid, places: Floats) -> tuple[Floats, Floats]:
    """(east_m, north_m), each (n,), of fractional posts (n, 2)."""
    east_m = grid.origin_east_m + places[:, 1] * grid.cell_east_m
    north_m = grid.origin_north_m - places[:, 0] * grid.cell_north_m
    return east_m, north_m


def sampled(places: Floats, apart: float) -> tuple[Floats, npt.NDArray[np.int64]]:
    """(places at most so many cells apart, which of them are the way's own)."""
    out, corners = [places[:1]], [0]
    for begin, end in itertools.pairwise(places):
        steps = max(math.ceil(float(np.hypot(*(end - begin))) / apart), 1)
        share = np.arange(1, steps + 1)[:, None] / steps
        piece = begin + share * (end - begin)
        piece[-1] = end
        out.append(piece)
        corners.append(corners[-1] + steps)
    return np.concatenate(out), np.array(corners, np.int64)
