"""Many points of a request brought into the grid's frame at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from service.parts.map_facts import check_bodies
from service.parts.points import PointIn
from terrain import ElevationGrid, height_at, to_grid_frame
from visibility import VisibilityInputError

__all__ = ["points_in_grid"]


def points_in_grid(grid: ElevationGrid, points: Sequence[PointIn], called: str) -> npt.NDArray[np.float64]:
    """(n, 3) float64: east, north and altitude of each point, metres in the grid's frame.

    called: what error sentences call a point, with {} for its number.
    Raises FrameError (degrees that have no place on the grid), VisibilityInputError (a height above ground that is
    unknown or not there).
    """
    in_m = np.array([_numbers(point.east_m, point.north_m, point.altitude_m) for point in points])
    in_deg = np.array([_numbers(point.lon_deg, point.lat_deg, point.above_ground_m) for point in points])
    check_bodies(grid, (point.body for point in points))
    by_degrees = ~np.isnan(in_deg[:, 0])
    if by_degrees.any():
        in_m[by_degrees, 0], in_m[by_degrees, 1] = to_grid_frame(grid, in_deg[by_degrees, 0], in_deg[by_degrees, 1])
    by_ground = ~np.isnan(in_deg[:, 2])
    in_m[by_ground, 2] = height_at(grid, in_m[by_ground, 0], in_m[by_ground, 1]) + in_deg[by_ground, 2]
    nowhere = np.isnan(in_m[:, 2])
    if nowhere.any():
        number = int(np.argmax(nowhere))
        outside = not grid.contains(in_m[number, 0], in_m[number, 1])
        where = "lies outside the DEM, where no ground is known" if outside else "lies on unknown ground"
        raise VisibilityInputError(
            f"{called.format(number)} {where}; give its altitude_m instead of above_ground_m, or move it."
        )
    return in_m


def _numbers(*values: float | None) -> tuple[float, ...]:
    return tuple(np.nan if value is None else value for value in values)
