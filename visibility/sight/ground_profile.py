"""The ground under a straight line between two points, for plots and tables."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.sight.curvature import Curvature
from visibility.sight.kernels.crossings import GridPoint
from visibility.sight.kernels.profiles import ground_profile, profile_room
from visibility.sight.sight_points import check_point, in_posts

__all__ = ["GroundProfile", "profile"]

SAME_SHARE = 1e-12


@dataclass(frozen=True, eq=False)
class GroundProfile:
    """Ground and line wherever the line crosses an edge of the triangulation, and under its ends; m places in order.

    distance_m: (m,) horizontal distance from the first point. ground_m: (m,) altitude of the ground; NaN = unknown.
    line_m: (m,) altitude of the line; with curvature it sags between its ends, as the ground would otherwise bulge.
    clearance_m: (m,) line over ground. Between two places each of them is straight. Parts outside the DEM have none.
    """

    distance_m: npt.NDArray[np.float64]
    ground_m: npt.NDArray[np.float64]
    line_m: npt.NDArray[np.float64]
    clearance_m: npt.NDArray[np.float64]
    curvature: Curvature


def profile(
    grid: ElevationGrid, from_point: npt.ArrayLike, to_point: npt.ArrayLike, *, curvature: Curvature | None = None
) -> GroundProfile:
    """The ground under the straight line between two points (east, north, altitude) in the grid's frame, metres.

    curvature: None takes what the grid's CRS implies (Curvature.of); FLAT switches it off. Raises VisibilityInputError.
    """
    start_m, end_m = check_point(grid, "from_point", from_point), check_point(grid, "to_point", to_point)
    curvature = Curvature.over(grid, curvature)
    start, end = (GridPoint(*in_posts(grid, point[None])[0].tolist()) for point in (start_m, end_m))
    places = np.empty((profile_room(grid.rows, grid.cols), 3))
    cells_m = (grid.cell_east_m, grid.cell_north_m)
    count = ground_profile(grid.heights_m, cells_m, curvature.drop_per_m2, start, end, places)
    share, ground_m, clearance_m = places[:count].T
    # a post is met by a row, a column and a diagonal at once
    new = np.diff(share, prepend=-1.0) > SAME_SHARE
    share, ground_m, clearance_m = share[new], ground_m[new], clearance_m[new]
    reach_m = float(np.hypot(*(end_m - start_m)[:2]))
    sag_m = curvature.drop_m(reach_m) * share * (1.0 - share)
    line_m = start_m[2] + share * (end_m[2] - start_m[2]) - sag_m
    return GroundProfile(share * reach_m, ground_m, line_m, clearance_m, curvature)
