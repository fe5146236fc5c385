"""What a satellite receiver heard, over a map: its satellites in the frame, its first place, whom the ground hides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gnss import Place
from gnss.sky import place_of_ecef
from navigation import StateError
from navigation.drives import Satellites
from terrain import ElevationGrid, body_of, height_at, to_grid_frame, to_lon_lat
from terrain.datums.references import MEAN_SEA_LEVEL, vertical_datum_of
from terrain.datums.surfaces import zero_surface
from visibility import lines_of_sight
from visibility.satellites.hidden import lines_towards
from visibility.sight import HIDDEN

from .frames import MapFrame

__all__ = ["framed_satellites", "receiver_place_m", "sky_of_drive"]

Array = npt.NDArray[np.float64]
LEAST_ABOVE_GROUND_M = 0.1


def receiver_place_m(grid: ElevationGrid, heard: Satellites) -> Array:
    """(3,) east, north, altitude in the grid's frame of a receiver's first place, ECEF. Raises StateError, FrameError.

    Where nobody knows what the grid's heights count from, that is mean sea level.
    """
    _on_earth(grid)
    place = place_of_ecef(heard.place_m)
    east_m, north_m = to_grid_frame(grid, place.lon_deg, place.lat_deg)
    return np.array([float(east_m), float(north_m), place.height_m - _zero_m(grid, place)])


def framed_satellites(grid: ElevationGrid, heard: Satellites, frame: MapFrame) -> tuple[Satellites, tuple[str, ...]]:
    """(the same in the frame, what was assumed). The frame's altitudes are the grid's, not above the ellipsoid: the sky
    is lowered by what is between the two. Raises StateError."""
    _on_earth(grid)
    told: tuple[str, ...] = ()
    if vertical_datum_of(grid) is None:
        told = ("Nobody knows what the map's heights count from; for satellites they are taken to be above the sea.",)
    zero_m = _zero_m(grid, place_of_ecef(heard.place_m))
    above = replace(frame.tangent, altitude_m=frame.tangent.altitude_m + zero_m)
    return replace(
        heard, positions_m=above.from_centred_m(heard.positions_m), place_m=above.from_centred_m(heard.place_m)
    ), told


def sky_of_drive(
    grid: ElevationGrid, heard: Satellites, frame: MapFrame, at_s: Array, places_m: Array, antenna_m: float | None
) -> Array:
    """(n,) whether the map leaves each row's satellite (in the frame) in sight: 1 or 0, NaN over unknown ground.

    at_s: (k,) and places_m: (k, 3) of the track, in the grid. antenna_m: above the ground; None = as the track flies.
    """
    sky = np.full(len(heard.times_s), np.nan)
    nearest = np.searchsorted((at_s[1:] + at_s[:-1]) / 2.0, heard.times_s)
    lon_deg, lat_deg = to_lon_lat(grid, places_m[:, 0], places_m[:, 1])
    ground_m = np.asarray(height_at(grid, places_m[:, 0], places_m[:, 1]))
    for step in np.unique(nearest).tolist():
        if np.isnan(ground_m[step]):
            continue
        rows = np.flatnonzero(nearest == step)
        # one direction of each satellite serves for the step
        _, first, of_row = np.unique(heard.satellite[rows], return_index=True, return_inverse=True)
        east, north, up = (heard.positions_m[rows[first]] - heard.place_m).T
        above_m = antenna_m if antenna_m is not None else max(float(places_m[step, 2] - ground_m[step]), 0.0)
        place = Place(float(lon_deg[step]), float(lat_deg[step]), float(places_m[step, 2]))
        azimuth, elevation = np.arctan2(east, north), np.arctan2(up, np.hypot(east, north))
        lines = lines_towards(grid, place, azimuth, elevation, max(above_m, LEAST_ABOVE_GROUND_M))
        if lines is not None:
            seen = lines_of_sight(grid, lines.from_m, lines.to_m, curvature=lines.curvature)
            sky[rows] = np.where(seen.verdict == HIDDEN, 0.0, 1.0)[of_row]
    return sky


def _zero_m(grid: ElevationGrid, place: Place) -> float:
    """How high the grid's zero lies above the ellipsoid."""
    datum = vertical_datum_of(grid) or MEAN_SEA_LEVEL
    return float(zero_surface(datum, np.array([place.lon_deg]), np.array([place.lat_deg])).height_m[0])


def _on_earth(grid: ElevationGrid) -> None:
    if grid.crs is None or body_of(grid.crs).name != "Earth":
        raise StateError("Satellites need a DEM with a CRS, on Earth: nothing else tells where they stand.")
