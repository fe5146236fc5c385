"""Satellites that terrain hides from a receiver: what rises above a horizon, and which observations to leave out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gnss.errors import GnssInputError
from gnss.sky import Place, look_angles

from .observations import Observations
from .orbits import Orbits

__all__ = ["HorizonMask", "hidden_rows"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class HorizonMask:
    """How high the ground, and what stands on it, rises about a place: elevations at azimuths, linear between them.

    azimuth_rad: (n,) clockwise from true north, rising, within one turn. elevation_rad: (n,). Raises GnssInputError.
    """

    azimuth_rad: Array
    elevation_rad: Array

    def __post_init__(self) -> None:
        azimuth, elevation = np.asarray(self.azimuth_rad, np.float64), np.asarray(self.elevation_rad, np.float64)
        if azimuth.ndim != 1 or azimuth.shape != elevation.shape or not len(azimuth):
            raise GnssInputError("A horizon needs as many elevations as azimuths, one at least.")
        if not (np.isfinite(azimuth).all() and np.isfinite(elevation).all()):
            raise GnssInputError("A horizon's azimuths and elevations must be finite.")
        if (np.diff(azimuth) <= 0.0).any() or azimuth[-1] - azimuth[0] >= 2.0 * math.pi:
            raise GnssInputError("A horizon's azimuths must rise within one turn.")
        object.__setattr__(self, "azimuth_rad", azimuth)
        object.__setattr__(self, "elevation_rad", elevation)

    def hides(self, azimuth_rad: npt.ArrayLike, elevation_rad: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Whether a direction lies below the horizon, of one shape with the angles; NaN is hidden."""
        above = np.asarray(elevation_rad, np.float64) > np.interp(
            np.asarray(azimuth_rad, np.float64), self.azimuth_rad, self.elevation_rad, period=2.0 * math.pi
        )
        return ~np.asarray(above, np.bool_)


def hidden_rows(observed: Observations, orbits: Orbits, place: Place, horizon: HorizonMask) -> npt.NDArray[np.bool_]:
    """(rows,) whether the satellite of each row stands below the horizon of the place; one without an orbit does.

    A satellite moves 0.01° while its signal flies and 0.5° in a minute: directions are those at the time of reception.
    """
    positions_m = np.array(
        [
            orbits.positions_ecef_m(int(whole_s), float(part_s), str(name))
            for whole_s, part_s, name in zip(observed.whole_s, observed.part_s, observed.satellite, strict=True)
        ]
    ).reshape(-1, 3)
    seen = look_angles(place, positions_m)
    return horizon.hides(seen.azimuth_rad, seen.elevation_rad)
