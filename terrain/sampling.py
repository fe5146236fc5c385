"""Heights of the triangulated surface at any position."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from . import kernels
from .grid import ElevationGrid

__all__ = ["height_at"]


def height_at(grid: ElevationGrid, east_m: npt.ArrayLike, north_m: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Height of the triangulated surface, metres; NaN outside the grid and on unknown ground.

    east_m, north_m: scalars or arrays that broadcast together, metres in the grid's frame; the result has their shape.
    """
    east, north = np.broadcast_arrays(np.asarray(east_m, np.float64), np.asarray(north_m, np.float64))
    row, col = grid.post_at(east.ravel(), north.ravel())
    heights_m = np.full(east.size, np.nan)
    kernels.surface_heights(grid.heights_m, np.ascontiguousarray(row), np.ascontiguousarray(col), heights_m)
    return heights_m.reshape(east.shape)
