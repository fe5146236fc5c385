"""Grounds and eyes that the tests of minimum visible altitude share."""

from pathlib import Path

import numpy as np
import pytest

from terrain import ElevationGrid, read_dem
from terrain.synthetic import fractal
from visibility import Anchor

DEMS = Path(__file__).parents[2] / "../shared/data/dem"


def real_dem(name, **options):
    """A DEM of the shared data; the test is skipped where that folder is absent."""
    path = DEMS / name
    if not path.exists():
        pytest.skip(f"{name} of the shared data is not here")
    return read_dem(path, **options)


def window(grid, row, col, rows, cols):
    """A part of a grid that keeps its place in the world."""
    east_m, north_m = grid.position_of(row, col)
    heights_m = grid.heights_m[row : row + rows, col : col + cols]
    return ElevationGrid(heights_m, grid.cell_east_m, grid.cell_north_m, east_m, north_m, grid.crs)


def rough(seed, rows, cols, cells_m=(30.0, 30.0), relief_m=40.0):
    """White noise: the roughest ground there is; cells_m = (east, north)."""
    rng = np.random.default_rng(seed)
    return ElevationGrid(rng.uniform(0.0, relief_m, (rows, cols)), *cells_m)


def hills(size=33, seed=3):
    """Fractal hills."""
    return fractal(size, seed=seed, relief_m=400.0)


def eye(grid, row, col, altitude_m, name="A", **more):
    """An anchor at a fractional post position."""
    east_m, north_m = grid.position_of(row, col)
    return Anchor(name, east_m, north_m, altitude_m, **more)


def clearing_eye(grid, row, col, above_m=15.0, **more):
    """An anchor so far above the highest of the four posts around a position, inside or outside the grid."""
    rows = slice(int(np.clip(np.floor(row), 0, grid.rows - 1)), int(np.clip(np.floor(row), 0, grid.rows - 1)) + 2)
    cols = slice(int(np.clip(np.floor(col), 0, grid.cols - 1)), int(np.clip(np.floor(col), 0, grid.cols - 1)) + 2)
    return eye(grid, row, col, float(np.nanmax(grid.heights_m[rows, cols])) + above_m, **more)
