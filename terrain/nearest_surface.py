"""How near the ground is in space: the exact distance to the triangulated surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .errors import ElevationGridError
from .grid import ElevationGrid
from .kernels import nearest as kernel

__all__ = ["NearestSurface", "nearest_surface"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class NearestSurface:
    """The answer to ``nearest_surface``, for n points.

    distance_m: (n,) to the nearest place of the surface, in space; negative below the ground, NaN outside the grid and
        over unknown ground. nearest_m: (n, 3) that place, east, north, altitude; NaN likewise.
    unknown_m: (n,) horizontal distance to the nearest unknown ground, inf where there is none, NaN outside the grid.
        The true surface may be as near as the smaller of the two.
    """

    distance_m: Array
    nearest_m: Array
    unknown_m: Array


def nearest_surface(grid: ElevationGrid, points_m: npt.ArrayLike) -> NearestSurface:
    """Signed distance of points (n, 3), east, north, altitude in the grid's frame, to the triangulated surface.

    A pyramid of the lowest and highest ground leaves out what cannot be nearer; it is built anew in each call, in time
    proportional to the grid's size, so ask for many points at once. Raises ElevationGridError where points are none.
    """
    try:
        points = np.array(points_m, np.float64, ndmin=2)
    except (TypeError, ValueError) as error:
        raise ElevationGridError(f"points_m must hold east, north and altitude in metres ({error}).") from error
    if points.size == 0:
        return NearestSurface(np.empty(0), np.empty((0, 3)), np.empty(0))
    if points.ndim != 2 or points.shape[1] != 3:
        raise ElevationGridError(f"points_m must hold east, north and altitude of each point, not {points.shape}.")
    heights_m = grid.heights_m
    origin_m = np.array([grid.origin_east_m, grid.origin_north_m, 0.0])
    places_m = points - origin_m
    # a single row or column gets the second line that kernels need, south or east of it, and no point lies over that
    if grid.rows == 1:
        heights_m = np.repeat(heights_m, 2, axis=0)
        places_m[:, 1] = np.abs(places_m[:, 1])
    if grid.cols == 1:
        heights_m = np.repeat(heights_m, 2, axis=1)
        places_m[:, 0] = -np.abs(places_m[:, 0])
    nearest_m, distance_m, unknown_m = np.empty_like(points), np.empty(len(points)), np.empty(len(points))
    kernel.nearest_places(
        places_m,
        heights_m,
        (grid.cell_east_m, grid.cell_north_m),
        _pyramid(heights_m),
        nearest_m,
        distance_m,
        unknown_m,
    )
    return NearestSurface(distance_m, nearest_m + origin_m, unknown_m)


def _pyramid(heights_m: npt.NDArray[np.float32]) -> kernel.Pyramid:
    """The pyramid of the kernels over a grid of at least 2 × 2 posts."""
    rows, cols = heights_m.shape[0] - 1, heights_m.shape[1] - 1
    levels = [(0, rows, cols)]
    while rows * cols > 1:
        first = levels[-1][0] + rows * cols
        rows, cols = (rows + 1) // 2, (cols + 1) // 2
        levels.append((first, rows, cols))
    nodes = levels[-1][0] + 1
    low_m, high_m, holes = np.empty(nodes, np.float32), np.empty(nodes, np.float32), np.empty(nodes, np.bool_)
    table = np.array(levels, np.int64)
    kernel.build_pyramid(heights_m, table, low_m, high_m, holes)
    return kernel.Pyramid(low_m, high_m, holes, table)
