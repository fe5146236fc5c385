"""How a vehicle moves, as far as the filter knows: constant velocity, disturbed by white acceleration."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .errors import StateError

__all__ = ["MotionNoise"]


@dataclass(frozen=True, slots=True)
class MotionNoise:
    """Power spectral densities of the acceleration along each axis and of the clock's drift (qx, qy, qz, qc of eq. 31).

    Each in m²/s³: after t seconds a velocity has gathered a variance of q·t. The clock is in metres of range.
    Raises StateError.
    """

    east_m2_per_s3: float = 0.1
    north_m2_per_s3: float = 0.1
    up_m2_per_s3: float = 0.1
    clock_m2_per_s3: float = 0.1

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = float(getattr(self, name))
            if not (math.isfinite(value) and value >= 0.0):
                raise StateError(f"{name} must be zero or more, not {value}.")

    def psd(self) -> npt.NDArray[np.float64]:
        """(4,) east, north, up, clock."""
        return np.array([self.east_m2_per_s3, self.north_m2_per_s3, self.up_m2_per_s3, self.clock_m2_per_s3])
