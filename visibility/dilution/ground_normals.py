"""Which way the ground faces: unit normals of the triangulated surface, and at its posts.

Six triangles meet at a post, and none of them is the ground there. A dilution along the ground has one answer at a
post all the same, in a map and along a trajectory: by the mean of the slopes to the neighbours on both sides.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid

__all__ = ["post_normals", "rover_normals", "surface_normals"]

AT_POST = 1e-6  # of a cell: as terrain.height_at


def surface_normals(grid: ElevationGrid, east_m: npt.ArrayLike, north_m: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """(n, 3) upward unit normals, east, north, up, of the triangles over which positions (n,) lie.

    On an edge the triangle south-east of it, or south-west of a diagonal, counts. NaN outside the grid and on a
    triangle with an unknown post.
    """
    east, north = np.atleast_1d(np.asarray(east_m, np.float64)), np.atleast_1d(np.asarray(north_m, np.float64))
    row = (grid.origin_north_m - north) / grid.cell_north_m
    col = (east - grid.origin_east_m) / grid.cell_east_m
    slack = 1e-6
    inside = (row >= -slack) & (row <= grid.rows - 1 + slack) & (col >= -slack) & (col <= grid.cols - 1 + slack)
    # a single row or column is level across
    heights_m = np.pad(grid.heights_m, ((0, int(grid.rows == 1)), (0, int(grid.cols == 1))), mode="edge")
    top = np.clip(np.where(inside, row, 0.0), 0, heights_m.shape[0] - 2).astype(np.intp)
    left = np.clip(np.where(inside, col, 0.0), 0, heights_m.shape[1] - 2).astype(np.intp)
    south_west = row - top >= col - left
    corner_m, far_m = heights_m[top, left].astype(np.float64), heights_m[top + 1, left + 1].astype(np.float64)
    third_m = np.where(south_west, heights_m[top + 1, left], heights_m[top, left + 1]).astype(np.float64)
    rise_east = np.where(south_west, far_m - third_m, third_m - corner_m) / grid.cell_east_m
    rise_north = np.where(south_west, corner_m - third_m, third_m - far_m) / grid.cell_north_m
    return _normals(np.where(inside, rise_east, np.nan), np.where(inside, rise_north, np.nan))


def post_normals(grid: ElevationGrid, first_row: int, stop_row: int) -> npt.NDArray[np.float64]:
    """(rows · cols, 3) upward unit normals at the posts of some rows, from the slopes to their neighbours.

    Each slope is the mean of those to both sides, or the one that is known; NaN where none is.
    """
    rows = np.arange(first_row - 1, stop_row + 1)
    heights_m = np.full((len(rows), grid.cols + 2), np.nan)
    on_grid = (rows >= 0) & (rows < grid.rows)
    heights_m[on_grid, 1:-1] = grid.heights_m[rows[on_grid]]
    here = slice(1, -1)
    slopes = _post_slopes(
        grid,
        heights_m[here, here],
        (heights_m[here, :-2], heights_m[here, 2:]),
        (heights_m[2:, here], heights_m[:-2, here]),
    )
    return _normals(*(slope.ravel() for slope in slopes))


def rover_normals(grid: ElevationGrid, east_m: npt.ArrayLike, north_m: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """(n, 3) upward unit normals for what stands on the ground: on a post as ``post_normals``, else of the triangle."""
    normals = surface_normals(grid, east_m, north_m)
    row, col = grid.post_at(
        np.atleast_1d(np.asarray(east_m, np.float64)), np.atleast_1d(np.asarray(north_m, np.float64))
    )
    inside = (row > -0.5) & (row < grid.rows - 0.5) & (col > -0.5) & (col < grid.cols - 0.5)
    near_row, near_col = np.rint(np.where(inside, row, 0.0)), np.rint(np.where(inside, col, 0.0))
    posts = np.flatnonzero(inside & (np.abs(row - near_row) <= AT_POST) & (np.abs(col - near_col) <= AT_POST))
    at_row, at_col = near_row[posts].astype(np.intp), near_col[posts].astype(np.intp)

    def beside(down: int, right: int) -> npt.NDArray[np.float64]:
        there = np.clip(at_row + down, 0, grid.rows - 1), np.clip(at_col + right, 0, grid.cols - 1)
        on_grid = (there[0] == at_row + down) & (there[1] == at_col + right)
        return np.where(on_grid, grid.heights_m[there].astype(np.float64), np.nan)

    slopes = _post_slopes(grid, beside(0, 0), (beside(0, -1), beside(0, 1)), (beside(1, 0), beside(-1, 0)))
    normals[posts] = _normals(*slopes)
    return normals


def _post_slopes(
    grid: ElevationGrid,
    post_m: npt.NDArray[np.float64],
    west_east_m: tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]],
    south_north_m: tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]],
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Rise east and north at posts, from their heights and their neighbours', NaN = unknown or none."""
    rises = []
    for (before_m, after_m), lines, cell_m in (
        (west_east_m, grid.cols, grid.cell_east_m),
        (south_north_m, grid.rows, grid.cell_north_m),
    ):
        # a single row or column is level across
        level = np.zeros(post_m.shape) + 0.0 * post_m
        rises.append(_mean_known(after_m - post_m, post_m - before_m) / cell_m if lines > 1 else level)
    return rises[0], rises[1]


def _mean_known(one: npt.NDArray[np.float64], other: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """The mean of two, or the only one that is known."""
    return np.where(np.isnan(one), other, np.where(np.isnan(other), one, (one + other) / 2.0))


def _normals(rise_east: npt.NDArray[np.float64], rise_north: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    normals = np.column_stack([-rise_east, -rise_north, np.ones(len(rise_east))])
    unit: npt.NDArray[np.float64] = normals / np.sqrt((normals**2).sum(axis=1, keepdims=True))
    return unit
