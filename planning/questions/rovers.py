"""What a rover can do: how big it is, how steep it climbs, how tight it turns, how fast it drives."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planning.errors import PathProblemError

__all__ = ["RoverModel"]

# how many slopes each way the pace is tabled for
PACES_EACH_WAY = 64


# curves that are far tighter or wider than any rover's are beyond the planner's arithmetic
LEAST_TURN_M = 0.01
WIDEST_TURN_M = 1e6


@dataclass(frozen=True, slots=True)
class RoverModel:
    """A rover on the ground.

    footprint_radius_m: radius of the disc it covers. receiver_above_ground_m: of its antenna, metres.
    max_slope_rad: of the ground under it; max_pitch_rad, max_roll_rad: of the ground along and across its way.
    max_step_m: how far ground under its footprint may depart from the plane that it stands on.
    min_turning_radius_m: 0 = turns on the spot. can_reverse: whether it may also drive backwards where it cannot.
    speed_m_per_s: on level ground. speed_over_slope: (slope_rad, speed_m_per_s) pairs with ascending slopes along the
        way, uphill positive, linear between and level beyond; () = speed_m_per_s on every slope.
    Raises PathProblemError.
    """

    footprint_radius_m: float = 0.5
    receiver_above_ground_m: float = 1.5
    max_slope_rad: float = math.radians(25.0)
    max_pitch_rad: float = math.pi / 2
    max_roll_rad: float = math.pi / 2
    max_step_m: float = math.inf
    min_turning_radius_m: float = 0.0
    can_reverse: bool = False
    speed_m_per_s: float = 1.0
    speed_over_slope: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        for name in ("footprint_radius_m", "receiver_above_ground_m", "min_turning_radius_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise PathProblemError(f"{name} must be a number of metres >= 0, not {value}.")
        if self.min_turning_radius_m != 0.0 and not LEAST_TURN_M <= self.min_turning_radius_m <= WIDEST_TURN_M:
            raise PathProblemError(
                f"min_turning_radius_m must be 0, for a rover that turns on the spot, or from {LEAST_TURN_M:g} to "
                f"{WIDEST_TURN_M:g} m, not {self.min_turning_radius_m:g} m."
            )
        for name in ("max_slope_rad", "max_pitch_rad", "max_roll_rad"):
            value = getattr(self, name)
            if not 0.0 < value <= math.pi / 2:
                raise PathProblemError(
                    f"{name} must be more than 0 and at most 90 degrees, not {math.degrees(value):g} degrees."
                )
        if not self.max_step_m > 0.0:
            raise PathProblemError(f"max_step_m must be a number of metres > 0, not {self.max_step_m}.")
        if not (math.isfinite(self.speed_m_per_s) and self.speed_m_per_s > 0.0):
            raise PathProblemError(f"speed_m_per_s must be a number > 0, not {self.speed_m_per_s}.")
        slopes = [slope for slope, _ in self.speed_over_slope]
        if any(not abs(slope) < math.pi / 2 for slope in slopes) or (np.diff(slopes) <= 0.0).any():
            raise PathProblemError("speed_over_slope needs ascending slopes of less than 90 degrees.")
        if any(not (math.isfinite(speed) and speed > 0.0) for _, speed in self.speed_over_slope):
            raise PathProblemError("speed_over_slope needs speeds > 0 m/s.")

    def speed_at(self, slope_rad: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Speed in m/s along ground that rises by slope_rad along the way; of the argument's shape."""
        slope = np.asarray(slope_rad, np.float64)
        if not self.speed_over_slope:
            return np.full(slope.shape, self.speed_m_per_s)
        slopes, speeds = np.array(self.speed_over_slope).T
        found: npt.NDArray[np.float64] = np.interp(slope, slopes, speeds)
        return found

    def pace_table(self) -> tuple[float, npt.NDArray[np.float64]]:
        """(steepest tangent, seconds per horizontal metre over tangents from -1 to 1 times that)."""
        steepest = min(math.tan(min(self.max_slope_rad, math.radians(85.0))), math.tan(math.radians(85.0)))
        tangent = np.linspace(-steepest, steepest, 2 * PACES_EACH_WAY + 1)
        return steepest, np.sqrt(1.0 + tangent**2) / self.speed_at(np.arctan(tangent))
