"""What a vehicle in a street hears and feels: pseudoranges, its wheels and turns, and how far each is believed."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError, StateError

__all__ = ["StreetErrors", "StreetRanges", "StreetStart", "WheelReadings"]

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Three = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class StreetRanges:
    """m pseudoranges in order of time, corrected for the satellites' clocks and the atmosphere.

    times_s, measured_m: (m,), NaN = none came. satellites_ecef_m: (m, 3) where each was when it sent, in the body-fixed
    frame of that instant; what the body turns meanwhile is taken care of. satellite, system: (m,) names, whole numbers;
    every system has a clock of its own. sigmas_m: (m,) of one range in sight. sight: (m,) or one, probability that a
    map gives to each being in sight; 0 leaves a range to be one that lies.
    """

    times_s: Array
    measured_m: Array
    satellites_ecef_m: Array
    satellite: Ints
    system: Ints
    sigmas_m: Array
    sight: npt.ArrayLike = 1.0


@dataclass(frozen=True, eq=False)
class WheelReadings:
    """times_s (k,), forward_m_per_s (k,), turns_rad_per_s (k,) to the left, as an odometer and a gyro tell them."""

    times_s: Array
    forward_m_per_s: Array
    turns_rad_per_s: Array


@dataclass(frozen=True)
class StreetStart:
    """What is believed at the first pseudorange, east, north, up in the frame. Raises StateError.

    heading_rad: clockwise from north. The clocks are taken from the first epoch.
    """

    position_m: Three
    heading_rad: float
    position_sigma_m: float = 20.0
    height_sigma_m: float = 20.0
    heading_sigma_rad: float = 0.1
    turn_bias_sigma_rad_per_s: float = 0.01

    def __post_init__(self) -> None:
        if not all(math.isfinite(value) for value in (*self.position_m, self.heading_rad)):
            raise StateError("position_m and heading_rad at the beginning must be finite.")
        for one in fields(self):
            if "_sigma_" in one.name and not 0.0 < getattr(self, one.name) < math.inf:
                raise StateError(f"{one.name} must be above zero and finite.")


@dataclass(frozen=True)
class StreetErrors:
    """How pseudoranges in streets err, and wheels.

    hidden_share: of the ranges, so many come round a corner, hidden_lasting_s long, too long by an exponential of
    excess_mean_m that stays the same for excess_steady_s: at the pace of a car until the wall has another stone.
    slow_factor, slow_s: most of what a range in sight errs by stays for so long, with a sigma so many times the one
    stated, as ``ConstantVelocityEstimator`` has it of ranges; white_m: what does not stay. alike_rad: satellites that
    stand near each other in the sky see the same walls, so that what stays correlates, by exp(-angle / alike_rad).
    along, upwards, turning: of the wheels' way and the gyro, white, in a second. turn_walk, clock, drift: random walks.
    Raises MeasurementError.
    """

    hidden_share: float = 0.5
    hidden_lasting_s: float = 10.0
    excess_mean_m: float = 50.0
    excess_steady_s: float = 2.0
    slow_factor: float = 2.0
    slow_s: float = 30.0
    white_m: float = 3.0
    alike_rad: float = math.radians(30.0)
    along_m_per_sqrt_s: float = 0.05
    upwards_m_per_sqrt_s: float = 0.03
    turning_rad_per_sqrt_s: float = 0.005
    turn_walk_rad_per_s_sqrt_s: float = 1e-4
    clock_m_per_sqrt_s: float = 0.1
    drift_m_per_s_sqrt_s: float = 0.3
    system_offset_m: float = 30.0

    def __post_init__(self) -> None:
        for one in fields(self):
            if not 0.0 < getattr(self, one.name) < math.inf:
                raise MeasurementError(f"{one.name} must be above zero and finite.")
        if not self.hidden_share < 1.0:
            raise MeasurementError("hidden_share must be below 1.")
