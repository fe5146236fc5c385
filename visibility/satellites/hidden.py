"""Which satellites the terrain, and what stands on it, hides from a receiver that drives."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gnss.differential import Observations, Orbits
from gnss.sky import Place, look_angles, place_of_ecef
from terrain import ElevationGrid, height_at, to_grid_frame

from ..errors import VisibilityInputError
from ..sight.curvature import Curvature
from ..sight.minimum_altitude import HIDDEN
from ..sight.sight_lines import lines_of_sight
from .horizon import to_border_m
from .in_view import true_to_grid

__all__ = ["LinesTowards", "hidden_observations", "lines_towards"]

Array = npt.NDArray[np.float64]


def hidden_observations(
    grid: ElevationGrid,
    observed: Observations,
    orbits: Orbits,
    rover_ecef_m: npt.ArrayLike,
    antenna_above_ground_m: float = 2.0,
) -> npt.NDArray[np.bool_]:
    """(rows of observed,) whether ground or buildings of a grid stand between the rover and the satellite of a row.

    rover_ecef_m: (epochs, 3) about where the rover was, NaN where nobody knows: the nearest epoch's place serves there.
    Its antenna stands above the grid's own ground, so that no datum enters. A satellite without an orbit counts as
    hidden; what only unknown ground or ground beyond the DEM may hide does not, and of epochs at which the rover was
    beyond the DEM only what is below the horizontal does. Raises VisibilityInputError, also where all are, FrameError.
    """
    places_m = np.array(rover_ecef_m, np.float64)
    epochs = int(observed.epoch[-1]) + 1 if len(observed) else 0
    if places_m.shape != (epochs, 3):
        raise VisibilityInputError(f"rover_ecef_m must be ({epochs}, 3), a place for each epoch, not {places_m.shape}.")
    known = np.flatnonzero(np.isfinite(places_m).all(axis=1))
    if not len(known):
        raise VisibilityInputError("Nobody knows where the rover was: not one place is finite.")
    if not any(_on_grid(grid, place_of_ecef(places_m[epoch])) for epoch in known):
        raise VisibilityInputError("The rover was nowhere on the DEM, which therefore tells nothing of its sky.")
    hidden = np.zeros(len(observed), np.bool_)
    for epoch in range(epochs):
        rows = np.flatnonzero(observed.epoch == epoch)
        near = int(known[np.argmin(np.abs(known - epoch))])
        hidden[rows] = _hidden(grid, observed, orbits, rows, places_m[near], antenna_above_ground_m)
    return hidden


def _hidden(
    grid: ElevationGrid,
    observed: Observations,
    orbits: Orbits,
    rows: npt.NDArray[np.intp],
    rover_ecef_m: Array,
    above_ground_m: float,
) -> npt.NDArray[np.bool_]:
    """Of the rows of one epoch."""
    place = place_of_ecef(rover_ecef_m)
    positions_m = np.array(
        [
            orbits.positions_ecef_m(
                int(observed.whole_s[row]), float(observed.part_s[row]), str(observed.satellite[row])
            )
            for row in rows
        ]
    )
    seen = look_angles(place, positions_m)
    hidden = ~(seen.elevation_rad > 0.0)
    up = np.flatnonzero(~hidden)
    lines = lines_towards(grid, place, seen.azimuth_rad[up], seen.elevation_rad[up], above_ground_m)
    if lines is not None and len(up):
        hidden[up] = lines_of_sight(grid, lines.from_m, lines.to_m, curvature=lines.curvature).verdict == HIDDEN
    return np.asarray(hidden, np.bool_)


@dataclass(frozen=True, slots=True, eq=False)
class LinesTowards:
    """Lines of sight (n, 3) in the grid's frame from an antenna up to the DEM's border."""

    from_m: Array
    to_m: Array
    curvature: Curvature


def lines_towards(
    grid: ElevationGrid, place: Place, azimuth_rad: Array, elevation_rad: Array, above_ground_m: float
) -> LinesTowards | None:
    """Towards n directions, true azimuths and elevations above the horizontal; None where the DEM knows no ground."""
    at_m = _on_grid(grid, place)
    if at_m is None:
        return None
    east_m, north_m, ground_m = at_m
    bent = Curvature.of(grid)
    directions = (true_to_grid(grid, place) @ np.array([np.sin(azimuth_rad), np.cos(azimuth_rad)])).T
    scales = np.hypot(*directions.T)
    directions = directions / scales[:, None]
    reaches_m = np.array([to_border_m(grid, east_m, north_m, direction) for direction in directions])
    from_m = np.array([east_m, north_m, ground_m + above_ground_m])
    rise_m = reaches_m / scales * np.tan(elevation_rad) + bent.drop_per_m2 * reaches_m**2
    to_m = np.column_stack([from_m[:2] + directions * reaches_m[:, None], from_m[2] + rise_m])
    return LinesTowards(np.broadcast_to(from_m, to_m.shape), to_m, bent)


def _on_grid(grid: ElevationGrid, place: Place) -> tuple[float, float, float] | None:
    """East, north and height of the ground under a place; None where the DEM knows none."""
    east_m, north_m = (float(value) for value in to_grid_frame(grid, place.lon_deg, place.lat_deg))
    ground_m = float(height_at(grid, east_m, north_m)) if grid.contains(east_m, north_m) else math.nan
    return None if math.isnan(ground_m) else (east_m, north_m, ground_m)
