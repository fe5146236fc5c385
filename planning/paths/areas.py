"""Which squares of the grid a polygon touches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from terrain import ElevationGrid

__all__ = ["outside_of", "squares_touched", "squares_with_middle_in"]

Mask = npt.NDArray[np.bool_]
Posts = npt.NDArray[np.integer[Any]]  # row or column numbers

# blocks of so many squares each way are asked before their squares are
BLOCK = 32
# a buffer's arcs are chords inside the true ones; this much further out they are outside
QUARTER = 16
OUTWARD = 1.0 / math.cos(math.pi / (4 * QUARTER))


def squares_touched(grid: ElevationGrid, zone: shapely.Geometry, apart_m: float) -> Mask:
    """(rows - 1, cols - 1) bool: squares that come within apart_m of a zone, for certain all of them."""
    touched = np.zeros((grid.rows - 1, grid.cols - 1), np.bool_)
    wide = zone.buffer(apart_m * OUTWARD, quad_segs=QUARTER) if apart_m > 0.0 else zone
    shapely.prepare(wide)
    block_rows, block_cols = np.arange(0, grid.rows - 1, BLOCK), np.arange(0, grid.cols - 1, BLOCK)
    row, col = (index.ravel() for index in np.meshgrid(block_rows, block_cols, indexing="ij"))
    last_row, last_col = np.minimum(row + BLOCK, grid.rows - 1), np.minimum(col + BLOCK, grid.cols - 1)
    blocks = _boxes(grid, row, col, last_row, last_col)
    whole, some = shapely.contains_properly(wide, blocks), shapely.intersects(wide, blocks)
    for n in np.flatnonzero(some):
        part = slice(row[n], last_row[n]), slice(col[n], last_col[n])
        if whole[n]:
            touched[part] = True
            continue
        r, c = (
            index.ravel()
            for index in np.meshgrid(np.arange(row[n], last_row[n]), np.arange(col[n], last_col[n]), indexing="ij")
        )
        touched[part] = shapely.intersects(wide, _boxes(grid, r, c, r + 1, c + 1)).reshape(touched[part].shape)
    return touched


def squares_with_middle_in(grid: ElevationGrid, zone: shapely.Geometry) -> Mask:
    """(rows - 1, cols - 1) bool: squares whose middle lies in a zone."""
    inside = np.zeros((grid.rows - 1, grid.cols - 1), np.bool_)
    west_m, south_m, east_m, north_m = zone.bounds
    top, left = grid.post_at(west_m, north_m)
    bottom, right = grid.post_at(east_m, south_m)
    rows = np.arange(max(math.floor(top - 0.5), 0), min(math.ceil(bottom + 0.5), grid.rows - 1))
    cols = np.arange(max(math.floor(left - 0.5), 0), min(math.ceil(right + 0.5), grid.cols - 1))
    if len(rows) and len(cols):
        shapely.prepare(zone)
        e, n = grid.position_of(rows[:, None] + 0.5, cols + 0.5)
        inside[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1] = shapely.intersects_xy(zone, *np.broadcast_arrays(e, n))
    return inside


def outside_of(grid: ElevationGrid, areas: Sequence[shapely.Geometry]) -> shapely.Geometry:
    """What is around the grid and in none of the areas."""
    west_m, south_m, east_m, north_m = grid.bounds_m
    far_m = (east_m - west_m) + (north_m - south_m)
    return shapely.box(west_m - far_m, south_m - far_m, east_m + far_m, north_m + far_m).difference(
        shapely.union_all(areas)
    )


def _boxes(grid: ElevationGrid, row: Posts, col: Posts, last_row: Posts, last_col: Posts) -> npt.NDArray[np.object_]:
    west_m, north_m = grid.position_of(row, col)
    east_m, south_m = grid.position_of(last_row, last_col)
    boxes: npt.NDArray[np.object_] = shapely.box(west_m, south_m, east_m, north_m)
    return boxes
