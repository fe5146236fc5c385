"""The grid's surface as triangles: the same ones that sampling and every sight-line engine use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .errors import ElevationGridError
from .grid import ElevationGrid

__all__ = ["TriangleMesh", "grid_mesh"]


@dataclass(frozen=True, slots=True, eq=False)
class TriangleMesh:
    """Triangles whose normals point up.

    vertices_m: (rows·cols, 3) float64, east, north, up in the grid's frame; the vertex of post (row, col) is number
    row·cols + col. Unknown posts have up = NaN and belong to no face.
    faces: (m, 3) int32, counter-clockwise seen from above.
    missing: (rows − 1, cols − 1, 2) bool, True for each triangle left out because a post of it is unknown;
    [..., 0] is the south-west half of the square below post (row, col), [..., 1] the north-east half.
    """

    vertices_m: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int32]
    missing: npt.NDArray[np.bool_]


def grid_mesh(grid: ElevationGrid, lowered_m: npt.ArrayLike | None = None) -> TriangleMesh:
    """The surface as a mesh: each square of posts cut by the diagonal from (row, col) to (row + 1, col + 1).

    lowered_m: (rows, cols) metres by which each post is lowered first (curvature), or None.
    A grid of one row or column has no triangles. Raises ElevationGridError.
    """
    rows, cols = grid.shape
    if rows * cols > np.iinfo(np.int32).max:
        raise ElevationGridError(f"A mesh of {rows * cols:,} posts is larger than 32-bit indices can number.")
    up_m = grid.heights_m.astype(np.float64)
    if lowered_m is not None:
        drop_m = np.asarray(lowered_m, np.float64)
        if drop_m.shape != grid.shape or not np.isfinite(drop_m).all():
            raise ElevationGridError(f"lowered_m must hold {rows} × {cols} finite numbers, not {drop_m.shape}.")
        up_m = up_m - drop_m
    east_m = grid.origin_east_m + np.arange(cols) * grid.cell_east_m
    north_m = grid.origin_north_m - np.arange(rows) * grid.cell_north_m
    vertices_m = np.stack([*np.broadcast_arrays(east_m[None, :], north_m[:, None]), up_m], axis=-1).reshape(-1, 3)
    number = np.arange(rows * cols, dtype=np.int32).reshape(rows, cols)
    north_west, north_east = number[:-1, :-1], number[:-1, 1:]
    south_west, south_east = number[1:, :-1], number[1:, 1:]
    halves = np.stack(
        [
            np.stack([north_west, south_west, south_east], axis=-1),
            np.stack([north_west, south_east, north_east], axis=-1),
        ],
        axis=-2,
    )
    missing = np.asarray(np.isnan(up_m).ravel()[halves].any(axis=-1), np.bool_)
    return TriangleMesh(vertices_m, halves[~missing], missing)
