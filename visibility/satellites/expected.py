"""What ground, roofs and trees leave of the signals of satellites: those to look for, and how weak they will be."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gnss.sky import Place
from terrain import ElevationGrid

from ..errors import VisibilityInputError
from ..sight.minimum_altitude import HIDDEN
from ..sight.sight_lines import lines_of_sight
from ..signal.foliage import foliage_of
from .hidden import lines_towards

__all__ = ["L1_HZ", "ExpectedSky", "expected_sky"]

Array = npt.NDArray[np.float64]
L1_HZ = 1575.42e6


@dataclass(frozen=True, eq=False)
class ExpectedSky:
    """Of n directions: hidden (n,) by ground or buildings, and loss_db (n,) in trees, NaN outside of their model."""

    hidden: npt.NDArray[np.bool_]
    loss_db: Array
    warnings: tuple[str, ...]


def expected_sky(
    grid: ElevationGrid,
    place: Place,
    azimuth_rad: npt.ArrayLike,
    elevation_rad: npt.ArrayLike,
    antenna_above_ground_m: float = 2.0,
    *,
    frequency_hz: float = L1_HZ,
) -> ExpectedSky:
    """What stands between an antenna over a place and directions (n,), true azimuths and elevations.

    What lies below the horizontal is hidden. Unknown ground, and ground beyond the DEM, hides nothing. Trees are those
    of the grid (``visibility.signal.with_foliage``). Raises VisibilityInputError for a place off the DEM, FrameError.
    """
    azimuth, elevation = np.atleast_1d(azimuth_rad).astype(np.float64), np.atleast_1d(elevation_rad).astype(np.float64)
    if azimuth.ndim != 1 or azimuth.shape != elevation.shape or not np.isfinite([azimuth, elevation]).all():
        raise VisibilityInputError("Directions need as many finite azimuths as elevations.")
    hidden, loss_db, warnings = ~(elevation > 0.0), np.zeros(len(azimuth)), tuple[str, ...]()
    up = np.flatnonzero(~hidden)
    lines = lines_towards(grid, place, azimuth[up], elevation[up], antenna_above_ground_m)
    if lines is None:
        raise VisibilityInputError(
            f"The DEM knows no ground at longitude {place.lon_deg:.6f}, latitude {place.lat_deg:.6f}."
        )
    if not len(up):
        return ExpectedSky(hidden, loss_db, warnings)
    hidden[up] = lines_of_sight(grid, lines.from_m, lines.to_m, curvature=lines.curvature).verdict == HIDDEN
    foliage = foliage_of(grid)
    if foliage is not None:
        _, lost = foliage.between(lines.from_m, lines.to_m, frequency_hz, lines.curvature)
        loss_db[up], warnings = lost.loss_db, lost.notes
    loss_db[hidden] = math.inf
    return ExpectedSky(hidden, loss_db, warnings)
