"""How much later a signal comes for the air: zenith delays and the mapping of Niell (De Vivo et al., eq. 37)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .errors import MeasurementError

__all__ = ["Troposphere", "niell_mapping", "troposphere_delay_m", "zenith_delays"]

Array = npt.NDArray[np.float64]

# A. E. Niell, Global mapping functions for the atmosphere delay at radio wavelengths, J. Geophys. Res. 101, 1996,
# tables 3 and 4: a, b, c at these latitudes.
LATITUDES_RAD = np.radians([15.0, 30.0, 45.0, 60.0, 75.0])
DRY_MEAN = np.array(
    [
        [1.2769934e-3, 1.2683230e-3, 1.2465397e-3, 1.2196049e-3, 1.2045996e-3],
        [2.9153695e-3, 2.9152299e-3, 2.9288445e-3, 2.9022565e-3, 2.9024912e-3],
        [62.610505e-3, 62.837393e-3, 63.721774e-3, 63.824265e-3, 64.258455e-3],
    ]
)
DRY_SEASON = np.array(
    [
        [0.0, 1.2709626e-5, 2.6523662e-5, 3.4000452e-5, 4.1202191e-5],
        [0.0, 2.1414979e-5, 3.0160779e-5, 7.2562722e-5, 11.723375e-5],
        [0.0, 9.0128400e-5, 4.3497037e-5, 84.795348e-5, 170.37206e-5],
    ]
)
WET = np.array(
    [
        [5.8021897e-4, 5.6794847e-4, 5.8118019e-4, 5.9727542e-4, 6.1641693e-4],
        [1.4275268e-3, 1.5138625e-3, 1.4572752e-3, 1.5007428e-3, 1.7599082e-3],
        [4.3472961e-2, 4.6729510e-2, 4.3908931e-2, 4.4626982e-2, 5.4736038e-2],
    ]
)
PER_KM = (2.53e-5, 5.49e-3, 1.14e-3)
COLDEST_DAY, DAYS_OF_YEAR = 28.0, 365.25

# below this the mapping is not meant to hold
LOWEST_RAD = math.radians(3.0)


@dataclass(frozen=True, slots=True)
class Troposphere:
    """Where and when: latitude, day of the year, and how humid the standard atmosphere is (0 to 1)."""

    latitude_rad: float
    day_of_year: float = 28.0
    humidity: float = 0.5

    def __post_init__(self) -> None:
        if not abs(self.latitude_rad) <= math.pi / 2.0:
            raise MeasurementError(f"latitude_rad must lie between the poles, not at {self.latitude_rad}.")
        if not 0.0 <= self.day_of_year <= 367.0:
            raise MeasurementError(f"day_of_year must lie between 0 and 366, not be {self.day_of_year}.")
        if not 0.0 <= self.humidity <= 1.0:
            raise MeasurementError(f"humidity must lie between 0 and 1, not be {self.humidity}.")


def zenith_delays(air: Troposphere, altitude_m: npt.ArrayLike) -> tuple[Array, Array]:
    """(dry, wet) delay towards the zenith, metres: Saastamoinen in the standard atmosphere at an altitude."""
    altitude = np.clip(np.asarray(altitude_m, np.float64), -1000.0, 10_000.0)
    pressure_hpa = 1013.25 * (1.0 - 2.2557e-5 * altitude) ** 5.2568
    kelvin = 288.16 - 6.5e-3 * altitude
    vapour_hpa = 6.108 * air.humidity * np.exp((17.15 * kelvin - 4684.0) / (kelvin - 38.45))
    dry = 0.0022768 * pressure_hpa / (1.0 - 0.00266 * math.cos(2.0 * air.latitude_rad) - 2.8e-7 * altitude)
    wet = 0.002277 * (1255.0 / kelvin + 0.05) * vapour_hpa
    return dry, wet


def niell_mapping(air: Troposphere, elevation_rad: npt.ArrayLike, altitude_m: npt.ArrayLike) -> tuple[Array, Array]:
    """(dry, wet) factors by which the delay towards the zenith grows towards an elevation; 1 at the zenith.

    Elevations of 3 degrees and more; arrays broadcast. Raises MeasurementError.
    """
    elevation = np.asarray(elevation_rad, np.float64)
    if not ((elevation >= LOWEST_RAD) & (elevation <= math.pi / 2.0 + 1e-12)).all():
        raise MeasurementError("elevation_rad must lie between 3 degrees and the zenith.")
    # the southern half has its winter half a year later
    shift = 0.0 if air.latitude_rad >= 0.0 else 0.5
    season = math.cos(2.0 * math.pi * ((air.day_of_year - COLDEST_DAY) / DAYS_OF_YEAR + shift))
    dry_abc = _at(DRY_MEAN, air.latitude_rad) - season * _at(DRY_SEASON, air.latitude_rad)
    above = (1.0 / np.sin(elevation) - _fraction(elevation, PER_KM)) * np.asarray(altitude_m, np.float64) / 1000.0
    return _fraction(elevation, dry_abc) + above, _fraction(elevation, _at(WET, air.latitude_rad))


def troposphere_delay_m(air: Troposphere, elevation_rad: npt.ArrayLike, altitude_m: npt.ArrayLike) -> Array:
    """T_dry·M_dry(E) + T_wet·M_wet(E) (eq. 37), metres; raises MeasurementError."""
    dry, wet = zenith_delays(air, altitude_m)
    dry_factor, wet_factor = niell_mapping(air, elevation_rad, altitude_m)
    delay: Array = dry * dry_factor + wet * wet_factor
    return delay


def _at(table: Array, latitude_rad: float) -> Array:
    """(a, b, c) at a latitude, linear between the table's, constant beyond them."""
    return np.array([np.interp(abs(latitude_rad), LATITUDES_RAD, row) for row in table])


def _fraction(elevation_rad: Array, abc: npt.ArrayLike) -> Array:
    """Marini's continued fraction, 1 at the zenith."""
    a, b, c = np.asarray(abc, np.float64)
    sine = np.sin(elevation_rad)
    fraction: Array = (1.0 + a / (1.0 + b / (1.0 + c))) / (sine + a / (sine + b / (sine + c)))
    return fraction
