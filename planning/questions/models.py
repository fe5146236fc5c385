"""What a path is asked with: the rover, limits on positioning, costs, budgets, and how the rover navigates."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import get_args

import numpy as np
import numpy.typing as npt

from navigation import MotionNoise
from planning.errors import PathProblemError
from visibility.dilution import DopKind, least_anchors
from visibility.dilution.dop_questions import Measure

__all__ = ["MEASURES", "CostWeights", "NavigationModel", "PathLimits", "PlanBudget", "RoverModel"]

MEASURES = get_args(Measure)
# how many slopes each way the pace is tabled for
PACES_EACH_WAY = 64
# curves that are far tighter or wider than any rover's are beyond the planner's arithmetic
LEAST_TURN_M = 0.01
WIDEST_TURN_M = 1e6


@dataclass(frozen=True, slots=True)
class PathLimits:
    """Limits on positioning that hold at every point of a path.

    min_anchors: at least so many anchors in sight, 0 = no limit. dop_limit: dilution below it (De Vivo et al.,
        eq. 15), inf = no limit.
    kind, measure, on_surface: which dilution, as in ``visibility.dop_map``.
    in_sight_from: how many anchors in sight make a place count as in sight; None = as many as a fix needs. A soft
        limit: see CostWeights.out_of_sight.
    bubble_epsilon: with a number above 0, what may not be driven stays further away than r = epsilon·sqrt(trace P) +
        dem_sigma_m at every point, P the covariance that the filter will have there (De Vivo et al., eqs. 25, 27).
    Raises PathProblemError, also where limits contradict one another.
    """

    min_anchors: int = 0
    dop_limit: float = math.inf
    kind: DopKind = "ranging"
    measure: Measure = "pdop"
    on_surface: bool = False
    in_sight_from: int | None = None
    bubble_epsilon: float = 0.0
    dem_sigma_m: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in get_args(DopKind):
            raise PathProblemError(f"kind must be one of {', '.join(get_args(DopKind))}, not {self.kind!r}.")
        if self.measure not in MEASURES:
            raise PathProblemError(f"measure must be one of {', '.join(MEASURES)}, not {self.measure!r}.")
        if self.min_anchors < 0 or (self.in_sight_from is not None and self.in_sight_from < 1):
            raise PathProblemError("min_anchors must be >= 0 and in_sight_from >= 1.")
        for name in ("bubble_epsilon", "dem_sigma_m"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise PathProblemError(f"{name} must be a number >= 0, not {getattr(self, name)}.")
        if not self.dop_limit > 0.0:
            raise PathProblemError(f"dop_limit must be a number > 0, not {self.dop_limit}.")

    @property
    def needed_in_sight(self) -> int:
        """How many anchors in sight make a place count as in sight."""
        if self.in_sight_from is not None:
            return self.in_sight_from
        return least_anchors(self.kind, on_surface=self.on_surface)

    @property
    def on_positioning(self) -> bool:
        """Whether anything is asked of the anchors."""
        return self.min_anchors > 0 or math.isfinite(self.dop_limit) or self.bubble_epsilon > 0.0


@dataclass(frozen=True, slots=True)
class CostWeights:
    """What a path costs, in units of a metre on level ground.

    length: of a metre along the ground. climb: of a metre climbed. time: of a second. dop: of a metre for each unit of
    dilution, which counts up to 20. out_of_sight: of a second with fewer anchors in sight than a fix needs.
    position_error: of a metre for each metre of predicted one-sigma position error, up to 100 m: the belief-aware mode.
    Raises PathProblemError.
    """

    length: float = 1.0
    climb: float = 2.0
    time: float = 0.0
    dop: float = 0.0
    out_of_sight: float = 2.0
    position_error: float = 0.0

    def __post_init__(self) -> None:
        for weight in fields(self):
            value = getattr(self, weight.name)
            if not (math.isfinite(value) and value >= 0.0):
                raise PathProblemError(f"The weight {weight.name} must be a number >= 0, not {value}.")
        if self.length == self.time == 0.0:
            raise PathProblemError("A path must cost something for each metre: give length or time a weight > 0.")


@dataclass(frozen=True, slots=True)
class PlanBudget:
    """How much planning is paid for.

    iterations: of the sampling planner; the count that makes one seed give one path. seconds: time-out of the whole
    plan; a plan that it ends says so. sampling: whether the sampling planner runs at all; without it the answer is the
    grid's way, pulled straight. Raises PathProblemError.
    """

    iterations: int = 60_000
    seconds: float = 60.0
    sampling: bool = True

    def __post_init__(self) -> None:
        if self.iterations < 1 or not self.seconds > 0.0:
            raise PathProblemError(
                f"A budget needs at least one iteration and more than 0 s, not {self.iterations} and {self.seconds} s."
            )


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
