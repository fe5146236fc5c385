"""A map's grid and the frame that is navigated in: places, directions and covariances from one to the other."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from navigation import StateError
from navigation.inertial import EARTH, MARS, MOON, Body, TangentFrame
from terrain import ElevationGrid, body_of, grid_north, to_grid_frame, to_lon_lat

__all__ = ["BODIES", "MIDDLE_LATITUDE_DEG", "MapFrame", "map_frame"]

Array = npt.NDArray[np.float64]
BODIES: dict[str, Body] = {body.name: body for body in (EARTH, MOON, MARS)}
# of a map that lies nowhere
MIDDLE_LATITUDE_DEG = 45.0


@dataclass(frozen=True, eq=False)
class MapFrame:
    """East, north, up at a place of a map, that turns with the body and does not bend with the ground.

    origin_m: (3,) that place in the grid's frame. grid_north_rad: true azimuth of the grid's north there. warnings:
    what was assumed.
    """

    grid: ElevationGrid
    tangent: TangentFrame
    origin_m: Array
    grid_north_rad: float
    warnings: tuple[str, ...] = ()

    def to_frame(self, places_m: npt.ArrayLike) -> Array:
        """(n, 3) in the frame, of places (n, 3) east, north, altitude in the grid's frame; NaN stays NaN."""
        places = np.asarray(places_m, np.float64).reshape(-1, 3)
        if self.grid.crs is None:
            return places - self.origin_m
        found, there = np.full(places.shape, math.nan), ~np.isnan(places).any(axis=1)
        if there.any():
            lon_deg, lat_deg = to_lon_lat(self.grid, places[there, 0], places[there, 1])
            found[there] = self.tangent.from_geodetic_m(np.radians(lat_deg), np.radians(lon_deg), places[there, 2])
        return found

    def to_grid(self, places_m: npt.ArrayLike) -> Array:
        """(n, 3) east, north, altitude in the grid's frame, of places (n, 3) in the frame."""
        places = np.asarray(places_m, np.float64).reshape(-1, 3)
        if self.grid.crs is None:
            return places + self.origin_m
        lat_rad, lon_rad, altitude_m = self.tangent.to_geodetic(places)
        lon_deg = (np.degrees(lon_rad) + 180.0) % 360.0 - 180.0
        return np.column_stack([*to_grid_frame(self.grid, lon_deg, np.degrees(lat_rad)), altitude_m])

    @property
    def turn(self) -> Array:
        """(3, 3) that turns vectors of the frame (true east, north, up) into the grid's axes."""
        sine, cosine = math.sin(self.grid_north_rad), math.cos(self.grid_north_rad)
        return np.array([(cosine, -sine, 0.0), (sine, cosine, 0.0), (0.0, 0.0, 1.0)])


def map_frame(grid: ElevationGrid, origin_m: npt.ArrayLike, latitude_deg: float | None = None) -> MapFrame:
    """The frame at a place of a map (3,). latitude_deg: of a map without CRS, for gravity and the body's turning.

    Raises FrameError, StateError.
    """
    origin = np.asarray(origin_m, np.float64)
    if grid.crs is None:
        warnings: tuple[str, ...] = ()
        if latitude_deg is None:
            warnings = (
                f"The DEM has no CRS: it is taken to lie on Earth at {MIDDLE_LATITUDE_DEG:g}° north, for gravity and "
                "the Earth's turning; say lat_deg.",
            )
        latitude = math.radians(MIDDLE_LATITUDE_DEG if latitude_deg is None else latitude_deg)
        return MapFrame(grid, TangentFrame(latitude, altitude_m=float(origin[2])), origin, 0.0, warnings)
    if latitude_deg is not None:
        raise StateError("lat_deg is for a DEM without CRS; this one has one.")
    name = body_of(grid.crs).name
    if name not in BODIES:
        raise StateError(f"Gravity is known of {', '.join(BODIES)}, not of {name}.")
    lon_deg, lat_deg = to_lon_lat(grid, float(origin[0]), float(origin[1]))
    tangent = TangentFrame(math.radians(lat_deg), math.radians(lon_deg), float(origin[2]), BODIES[name])
    return MapFrame(grid, tangent, origin, grid_north(grid, float(origin[0]), float(origin[1])))
