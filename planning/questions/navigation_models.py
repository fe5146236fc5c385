"""How the rover will estimate where it is: what the predicted covariance along a path comes of."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from navigation import MotionNoise
from planning.errors import PathProblemError

__all__ = ["NavigationModel"]


@dataclass(frozen=True, slots=True)
class NavigationModel:
    """A filter of ranges on a rover whose height is known from the DEM.

    motion: what disturbs its constant velocity. interval_s: between ranges to each anchor in sight.
    initial_sigma_m: one sigma of each coordinate at the start. ground_sigma_m: of the DEM's height under the rover.
    initial_velocity_sigma_m_per_s: of each coordinate of the velocity there, small for one that sets out from rest.
    Raises PathProblemError.
    """

    motion: MotionNoise = field(default_factory=lambda: MotionNoise(0.01, 0.01, 0.01))
    interval_s: float = 1.0
    initial_sigma_m: float = 1.0
    ground_sigma_m: float = 0.5
    initial_velocity_sigma_m_per_s: float = 0.3

    def __post_init__(self) -> None:
        for name in ("interval_s", "initial_sigma_m", "ground_sigma_m", "initial_velocity_sigma_m_per_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise PathProblemError(f"{name} must be a number > 0, not {value}.")
