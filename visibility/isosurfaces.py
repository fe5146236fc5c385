"""The surface on which a dilution equals its limit (De Vivo et al., eq. 19), as triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from skimage.measure import marching_cubes

from terrain import ElevationGrid

from .control_volumes import WHOLE_VOXELS, ControlVolume, whole_volume
from .errors import VisibilityInputError
from .flight_limits import FlightLimit

__all__ = ["Isosurface", "isosurface"]


@dataclass(frozen=True, eq=False)
class Isosurface:
    """Triangles between flyable and no-flight air.

    vertices_m: (n, 3) float64 east, north, altitude in the grid's frame. faces: (m, 3) int32; normals point towards the
    flyable side. No vertex at all where the whole volume is on one side.
    """

    vertices_m: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int32]


def isosurface(volume: ControlVolume, limit: FlightLimit, *, max_voxels: int = WHOLE_VOXELS) -> Isosurface:
    """The surface DOP = limit within a control volume, by marching cubes between its voxels.

    Interpolated in 1/DOP, which is 0 where there is no fix or too few anchors are in sight, so each vertex lies among
    neighbouring voxels of which some are flyable and some are not. Where the visible set changes the dilution jumps,
    and the surface runs within one voxel of the jump. No surface is drawn against unknown air.
    Raises VisibilityInputError: fewer than two layers, rows or columns, or more voxels than max_voxels.
    """
    if min(volume.shape) < 2:
        raise VisibilityInputError(f"A surface needs two or more layers, rows and columns, not {volume.shape}.")
    if (volume.dilution, volume.kind) != (limit.dilution, limit.kind):
        raise VisibilityInputError(
            f"The volume holds {volume.dilution} of {volume.kind}, but the limit is one on {limit.dilution} of "
            f"{limit.kind}."
        )
    voxels = whole_volume(volume, max_voxels=max_voxels)
    goodness = np.where(voxels.count < limit.needed_anchors, np.float32(0.0), 1.0 / voxels.dop)
    known = ~np.isnan(voxels.dop)
    goodness[~known] = 0.0
    level = 1.0 / limit.dop_limit
    flyable = goodness > level
    if not (flyable[known].any() and (~flyable[known]).any()):
        return Isosurface(np.empty((0, 3)), np.empty((0, 3), np.int32))
    corners, faces, _, _ = marching_cubes(
        goodness, level, mask=known, gradient_direction="descent", allow_degenerate=False
    )
    return Isosurface(_positions_m(volume, corners.astype(np.float64)), np.ascontiguousarray(faces, np.int32))


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
