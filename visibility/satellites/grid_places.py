"""Places on a DEM as places on Earth, and how the DEM's axes lie there."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt
import pyproj
from pyproj.enums import TransformDirection

from gnss.sky import Place, enu_to_ecef_m
from terrain import ElevationGrid, FrameError, body_of, height_at, to_grid_frame, to_lon_lat
from visibility.sight.distant import middle_m

__all__ = ["place_on_grid", "true_to_grid"]

Array = npt.NDArray[np.float64]

STEP_M = 100.0


def place_on_grid(grid: ElevationGrid, east_m: float | None = None, north_m: float | None = None) -> Place:
    """The place on Earth over a position of a grid, on its ground; without a position, the grid's middle.

    Where the ground is unknown or absent, the mean of the known heights stands in for it.
    Raises FrameError for a grid without CRS or of another body.
    """
    _check_earth(grid)
    middle_east_m, middle_north_m = middle_m(grid)
    east_m = middle_east_m if east_m is None else east_m
    north_m = middle_north_m if north_m is None else north_m
    lon_deg, lat_deg = to_lon_lat(grid, east_m, north_m)
    height_m = float(height_at(grid, east_m, north_m)) if grid.contains(east_m, north_m) else np.nan
    if np.isnan(height_m):
        known_m = grid.heights_m[~np.isnan(grid.heights_m)]
        height_m = float(known_m.mean(dtype=np.float64)) if known_m.size else 0.0
    return Place(lon_deg, lat_deg, height_m)


def true_to_grid(grid: ElevationGrid, place: Place) -> Array:
    """(2, 2) matrix from true metres (east, north) at a place to metres of the grid's axes.

    For a conformal CRS: its scale there times the rotation by meridian convergence. The identity for a grid without
    CRS, whose north is taken as true. Raises FrameError for a grid of another body.
    """
    if grid.crs is None:
        return np.eye(2)
    _check_earth(grid)
    steps_enu_m = STEP_M * np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    # by way of ECEF, so that a pole is a place like any other
    ecef_x_m, ecef_y_m, ecef_z_m = enu_to_ecef_m(place, steps_enu_m).T
    lon_deg, lat_deg, _ = _ecef_of_lon_lat().transform(
        ecef_x_m, ecef_y_m, ecef_z_m, direction=TransformDirection.INVERSE
    )
    east_m, north_m = to_grid_frame(grid, np.asarray(lon_deg, np.float64), np.asarray(lat_deg, np.float64))
    return np.array(
        [[east_m[0] - east_m[1], east_m[2] - east_m[3]], [north_m[0] - north_m[1], north_m[2] - north_m[3]]]
    ) / (2.0 * STEP_M)


def _check_earth(grid: ElevationGrid) -> None:
    if grid.crs is None:
        raise FrameError("The DEM has no CRS, so its place on Earth is unknown; give the place (lon_deg, lat_deg).")
    body = body_of(grid.crs)
    if body.name != "Earth":
        raise FrameError(f"The DEM lies on {body.name}; GPS satellites serve places on Earth only.")


@lru_cache(maxsize=1)
def _ecef_of_lon_lat() -> pyproj.Transformer:
    return pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
