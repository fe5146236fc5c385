"""Where a grid lies, for whoever draws maps: its CRS in words of others, its transform, its bounds in degrees."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pyproj

from terrain import ElevationGrid, FrameError, to_lon_lat

__all__ = ["place_of"]

BORDER_POINTS = 65


def place_of(grid: ElevationGrid) -> dict[str, Any]:
    """crs_wkt, crs_proj, transform and bounds_deg of a DEM, ready for JSON."""
    return {
        "crs_wkt": None if grid.crs is None else grid.crs.to_wkt("WKT2_2019"),
        "crs_proj": None if grid.crs is None else _proj_string(grid.crs),
        "transform": [
            grid.cell_east_m, 0.0, grid.origin_east_m - grid.cell_east_m / 2.0,
            0.0, -grid.cell_north_m, grid.origin_north_m + grid.cell_north_m / 2.0,
        ],
        "bounds_deg": _bounds_deg(grid),
    }  # fmt: skip


def _proj_string(crs: pyproj.CRS) -> str | None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # that it says less than WKT, which is given as well
        return str(crs.to_proj4()) or None


def _bounds_deg(grid: ElevationGrid) -> dict[str, float] | None:
    if grid.crs is None:
        return None
    west, south, east, north = grid.bounds_m
    x, y = np.linspace(west, east, BORDER_POINTS), np.linspace(south, north, BORDER_POINTS)
    ring_x = np.concatenate([x, np.full_like(y, east), x[::-1], np.full_like(y, west)])
    ring_y = np.concatenate([np.full_like(x, south), y, np.full_like(x, north), y[::-1]])
    try:
        lon, lat = to_lon_lat(grid, ring_x, ring_y)
    except FrameError:
        return None  # a border where the CRS is not defined has no degrees
    lon = np.unwrap(lon, period=360.0)
    if abs(lon[-1] - lon[0]) > 180.0:  # round a pole
        pole = 90.0 if lat.mean() > 0.0 else -90.0
        south, north = min(float(lat.min()), pole), max(float(lat.max()), pole)
        return {"west": -180.0, "south": south, "east": 180.0, "north": north}
    lon -= 360.0 * np.floor((lon.min() + 180.0) / 360.0)
    return {"west": float(lon.min()), "south": float(lat.min()), "east": float(lon.max()), "north": float(lat.max())}
