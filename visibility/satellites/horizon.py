"""The terrain's horizon about a place, as a mask for satellites."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gnss.differential import HorizonMask
from terrain import ElevationGrid, height_at

from ..errors import VisibilityInputError
from ..sight.curvature import Curvature
from ..sight.sight_line import profile
from .in_view import place_on_grid, true_to_grid

__all__ = ["TerrainHorizon", "terrain_horizon", "to_border_m"]

MOST_AZIMUTHS = 36_000
FLAT_RAD = -math.pi / 2  # where no ground is known, nothing rises


@dataclass(frozen=True, slots=True, eq=False)
class TerrainHorizon:
    """How high the known ground rises about a place.

    mask: at true azimuths; −π/2 where no ground is known. unknown_share: of the azimuths, along which some ground of
    the DEM is unknown, so that something higher may stand there. Ground beyond the DEM is not in it.
    """

    mask: HorizonMask
    unknown_share: float


def terrain_horizon(
    grid: ElevationGrid,
    east_m: float,
    north_m: float,
    above_ground_m: float = 2.0,
    *,
    azimuths: int = 720,
    curvature: Curvature | None = None,
) -> TerrainHorizon:
    """The horizon of an antenna above a position of the grid, its axes' metres, at azimuths evenly round from north.

    Along each azimuth the ground is followed over every edge of its triangulation up to the DEM's border. Buildings and
    trees are not in it. curvature: None takes what the grid's CRS implies. A grid without CRS has its north as true.
    Raises VisibilityInputError, FrameError.
    """
    if not 3 <= azimuths <= MOST_AZIMUTHS:
        raise VisibilityInputError(f"azimuths must be 3 to {MOST_AZIMUTHS}, not {azimuths}.")
    if not grid.contains(east_m, north_m):
        raise VisibilityInputError(f"The DEM does not reach east {east_m:g}, north {north_m:g}.")
    ground_m = float(height_at(grid, east_m, north_m))
    if math.isnan(ground_m) or not math.isfinite(above_ground_m):
        raise VisibilityInputError("A horizon needs known ground under it and a finite height above it.")
    altitude_m = ground_m + above_ground_m
    bent = Curvature.over(grid, curvature)
    azimuth_rad = np.linspace(0.0, 2.0 * math.pi, azimuths, endpoint=False, dtype=np.float64)
    true = np.array([np.sin(azimuth_rad), np.cos(azimuth_rad)])
    directions = true.T if grid.crs is None else (true_to_grid(grid, place_on_grid(grid, east_m, north_m)) @ true).T
    elevation_rad = np.full(azimuths, FLAT_RAD)
    unknown = 0
    for number, direction in enumerate(directions):
        scale = float(np.hypot(*direction))
        reach_m = to_border_m(grid, east_m, north_m, direction / scale)
        if reach_m <= 0.0:
            continue
        end_east_m, end_north_m = np.array([east_m, north_m]) + direction / scale * reach_m
        under = profile(grid, (east_m, north_m, altitude_m), (end_east_m, end_north_m, altitude_m), curvature=bent)
        met = (under.distance_m > 0.0) & ~np.isnan(under.ground_m)
        unknown += int(np.isnan(under.ground_m).any())
        if met.any():
            distance_m = under.distance_m[met]
            rise_m = under.ground_m[met] - bent.drop_per_m2 * distance_m**2 - altitude_m
            elevation_rad[number] = np.arctan2(rise_m, distance_m / scale).max()
    return TerrainHorizon(HorizonMask(azimuth_rad, elevation_rad), unknown / azimuths)


def to_border_m(grid: ElevationGrid, east_m: float, north_m: float, direction: npt.NDArray[np.float64]) -> float:
    """How far the outermost posts are in a direction, metres."""
    west_m, south_m, border_east_m, border_north_m = grid.bounds_m
    reaches = [
        (bound_m - at_m) / step
        for at_m, step, bounds in (
            (east_m, float(direction[0]), (west_m, border_east_m)),
            (north_m, float(direction[1]), (south_m, border_north_m)),
        )
        for bound_m in bounds
        if step * (bound_m - at_m) > 0.0
    ]
    # a hair less, so that rounding does not lead outside
    return min(reaches) * (1.0 - 1e-12) if len(reaches) else 0.0
