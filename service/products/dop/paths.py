"""A trajectory through a DOP map: who is in sight, and how good positioning is, at each of its points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from service.parts.point_arrays import points_in_grid
from service.parts.positioning import DopMapParameters
from terrain import ElevationGrid
from visibility import MinimumVisibleAltitude, dop_along, position_error_along, visible_sets

__all__ = ["PATH_COLUMNS", "PathFindings", "along_path", "path_points"]

PATH_COLUMNS = (
    *("east_m", "north_m", "altitude_m", "anchors_in_sight", "unknown"),
    *("gdop", "pdop", "hdop", "vdop", "tdop", "reason"),
    *("horizontal_sigma_m", "vertical_sigma_m", "position_sigma_m"),
)


@dataclass(frozen=True, eq=False)
class PathFindings:
    """What is known along a trajectory: numbers (n, PATH_COLUMNS) float64, and visible sets (n, words) uint64."""

    numbers: npt.NDArray[np.float64]
    sets: npt.NDArray[np.uint64]


def path_points(grid: ElevationGrid, parameters: DopMapParameters) -> npt.NDArray[np.float64]:
    """(n, 3) points of the trajectory asked for, in the grid's frame. Raises FrameError, VisibilityInputError."""
    if not parameters.path:
        return np.empty((0, 3))
    return points_in_grid(grid, parameters.path, "path[{}]")


def along_path(lines: MinimumVisibleAltitude, parameters: DopMapParameters) -> PathFindings:
    """Visible sets, dilutions and errors at each point of the trajectory. Raises what path_points raises."""
    points_m = path_points(lines.grid, parameters)
    sets = visible_sets(lines, points_m)
    dilutions = dop_along(lines, points_m, parameters.kind, on_surface=parameters.on_surface)
    errors = position_error_along(lines, points_m, parameters.kind, on_surface=parameters.on_surface)
    numbers = np.column_stack(
        [
            *points_m.T,
            *(sets.count, sets.unknown),
            *(dilutions.gdop, dilutions.pdop, dilutions.hdop, dilutions.vdop, dilutions.tdop, dilutions.reason),
            *(errors.horizontal_sigma_m, errors.vertical_sigma_m, errors.position_sigma_m),
        ]
    )
    return PathFindings(numbers, sets.mask)
