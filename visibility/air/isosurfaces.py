"""The surface on which a dilution equals its limit (De Vivo et al., eq. 19), as triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from skimage.measure import marching_cubes

from terrain import ElevationGrid
from visibility.air.control_volumes import BLOCK_VOXELS, WHOLE_VOXELS, ControlVolume, VoxelBlock, volume_blocks
from visibility.dilution.dop_questions import FlightLimit
from visibility.errors import VisibilityInputError

__all__ = ["Isosurface", "isosurface"]

_Part = tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]

# of a voxel; vertices nearer than that are one
SAME_VERTEX = 1e-4


@dataclass(frozen=True, eq=False)
class Isosurface:
    """Triangles between flyable and no-flight air.

    vertices_m: (n, 3) float64 east, north, altitude in the grid's frame. faces: (m, 3) int32; normals point towards the
    flyable side. No vertex at all where the whole volume is on one side.
    """

    vertices_m: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int32]


def isosurface(
    volume: ControlVolume, limit: FlightLimit, *, max_voxels: int = WHOLE_VOXELS, block_voxels: int = BLOCK_VOXELS
) -> Isosurface:
    """The surface DOP = limit within a control volume, by marching cubes between its voxels.

    Interpolated in 1/DOP, which is 0 where there is no fix or too few anchors are in sight, so each vertex lies among
    neighbouring voxels of which some are flyable and some are not. Where the visible set changes the dilution jumps,
    and the surface runs within one voxel of the jump. No surface is drawn against unknown air.
    block_voxels: about so many are in memory at once; blocks share a row of voxels, and their vertices there.
    Raises VisibilityInputError: fewer than two layers, rows or columns, or more voxels than max_voxels.
    """
    if min(volume.shape) < 2:
        raise VisibilityInputError(f"A surface needs two or more layers, rows and columns, not {volume.shape}.")
    if (volume.measure, volume.kind) != (limit.measure, limit.kind):
        raise VisibilityInputError(
            f"The volume holds {volume.measure} of {volume.kind}, but the limit is one on {limit.measure} of "
            f"{limit.kind}."
        )
    if volume.voxels > max_voxels:
        layers, rows, cols = volume.shape
        raise VisibilityInputError(
            f"The volume has {volume.voxels:,} voxels ({layers:,} layers × {rows:,} × {cols:,}), more than the limit "
            f"of {max_voxels:,} for a surface; take thicker layers or smaller bounds."
        )
    parts: list[_Part] = []
    above: npt.NDArray[np.float32] | None = None  # the last row of the block before
    first = 0
    for block in volume_blocks(volume, block_voxels=block_voxels):
        goodness = _goodness(block, limit)
        joined = goodness if above is None else np.concatenate([above, goodness], axis=1)
        if joined.shape[1] > 1:
            parts.append(_march(joined, 1.0 / limit.dop_limit, first))
        above = joined[:, -1:]
        first += joined.shape[1] - 1
    corners, faces = _joined(parts)
    return Isosurface(_positions_m(volume, corners), faces)


def _goodness(block: VoxelBlock, limit: FlightLimit) -> npt.NDArray[np.float32]:
    """1/DOP, 0 where there is no fix or too few anchors are in sight, NaN where that is unknown."""
    goodness: npt.NDArray[np.float32] = np.where(block.count < limit.needed_anchors, np.float32(0.0), 1.0 / block.dop)
    goodness[np.isnan(block.dop)] = np.nan
    return goodness


def _march(goodness: npt.NDArray[np.float32], level: float, first_row: int) -> _Part:
    """Vertices as fractional (layer, row, col) of the whole volume, and faces, of one block."""
    known = ~np.isnan(goodness)
    values = np.where(known, goodness, np.float32(0.0))
    flyable = values > level
    if not (flyable[known].any() and (~flyable[known]).any()):
        return np.empty((0, 3)), np.empty((0, 3), np.int64)
    try:
        corners, faces, _, _ = marching_cubes(
            values, level, mask=known, gradient_direction="descent", allow_degenerate=False
        )
    except RuntimeError:
        # skimage's word for: every cube that the surface crosses has an unknown corner
        return np.empty((0, 3)), np.empty((0, 3), np.int64)
    return corners.astype(np.float64) + np.array([0.0, first_row, 0.0]), faces.astype(np.int64)


def _joined(parts: list[_Part]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]]:
    """One surface out of those of blocks; the vertices that two of them share become one."""
    counts = np.cumsum([0, *(len(corners) for corners, _ in parts)])
    corners = np.concatenate([np.empty((0, 3)), *(corners for corners, _ in parts)])
    faces = np.concatenate(
        [np.empty((0, 3), np.int64), *(part[1] + first for part, first in zip(parts, counts, strict=False))]
    )
    _, kept, number = np.unique(np.round(corners / SAME_VERTEX), axis=0, return_index=True, return_inverse=True)
    faces = number.reshape(-1)[faces]
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    return corners[kept], np.ascontiguousarray(faces[whole], np.int32)


def _positions_m(volume: ControlVolume, corners: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """(n, 3) east, north, altitude of fractional (layer, row, col)."""
    grid = volume.grid
    layer, row, col = corners.T
    altitude_m = np.interp(layer, np.arange(len(volume.layers)), volume.layers.altitudes_m)
    if volume.layers.above_ground:
        altitude_m = altitude_m + _ground_m(grid, row, col)
    east_m, north_m = grid.origin_east_m + col * grid.cell_east_m, grid.origin_north_m - row * grid.cell_north_m
    return np.stack([east_m, north_m, altitude_m], axis=-1)


def _ground_m(
    grid: ElevationGrid, row: npt.NDArray[np.float64], col: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Ground between the posts around each corner; posts that have no part in it may be unknown."""
    ground_m = np.zeros(row.shape)
    for down in (0, 1):
        for across in (0, 1):
            near_row, near_col = np.floor(row).astype(int) + down, np.floor(col).astype(int) + across
            weight = (1.0 - np.abs(row - near_row)) * (1.0 - np.abs(col - near_col))
            some = weight > 0.0
            ground_m[some] += weight[some] * grid.heights_m[near_row[some], near_col[some]]
    return ground_m
