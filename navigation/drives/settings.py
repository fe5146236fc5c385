"""What is known of a drive besides its log: the unit, how it is mounted, where it begins, what is believed how far."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Literal

from ..errors import MeasurementError
from ..inertial import IMU_PRESETS, ImuNoise, StandstillRule
from ..inertial.samples import turned

__all__ = ["DriveSettings"]

Three = tuple[float, float, float]
ZERO: Three = (0.0, 0.0, 0.0)
# may be nothing: known for certain, or switched off
OFF_AT_ZERO = ("lever_arm_sigma_m", "standstill_sigma_m_per_s", "sideways_sigma_m_per_s", "max_gap_s", "phase_sigma_m")


@dataclass(frozen=True)
class DriveSettings:
    """The options of a drive (seed 002, table 5.1); angles in radians, axes forward, left, up.

    imu: the unit's errors. axes, force_unit, rate_unit: of the log's readings. imu_late_s: how much later they are
    stamped than they were taken. max_gap_s: 0 = ten times the median step. lever_arm_m: from the unit to the antenna,
    its sigma 0 = it is not estimated.
    align_s: the beginning that levels the unit. heading_rad, position_m (east, north, up): at the beginning; None = as
    the log tells it. standstill_sigma: of zero velocity where the readings are still (ZUPT), sideways_sigma: of going
    neither sideways nor off the ground (NHC), 0 = off. mounting_rad: how far the direction of driving lies left of the
    unit's x axis, and above it. pivot_m: from the unit to amid the wheels, where it does not slide. *_sigma: of what
    the log gives no sigma for; pseudorange_sigma_m and phase_sigma_m of a satellite in the zenith, lower ones by the
    sine of the elevation more (phase_sigma_m 0 = phases are not used); those below least_elevation_rad are left out.
    gate_sigma: what lies further off is not believed. least_sight: ranges of less
    probability of sight are left out. hidden_excess_m: how much too long a range over a detour is in the mean; the less
    likely one is in sight, the less sure it is by that (0 = its variance is divided by the probability).
    antenna_above_ground_m: the ground's height is used where there is a map; None = it is not. epsilon: how many sigmas
    the bubble is. smoother: back through the log as well. Raises MeasurementError.
    """

    imu: ImuNoise = IMU_PRESETS["tactical"]
    axes: str = "flu"
    force_unit: Literal["m/s2", "g"] = "m/s2"
    rate_unit: Literal["rad/s", "deg/s"] = "rad/s"
    imu_late_s: float = 0.0
    max_gap_s: float = 0.0
    lever_arm_m: Three = ZERO
    lever_arm_sigma_m: float = 0.0
    align_s: float = 5.0
    heading_rad: float | None = None
    heading_sigma_rad: float = math.radians(5.0)
    position_m: Three | None = None
    position_sigma_m: float = 10.0
    velocity_sigma_m_per_s: float = 0.5
    standstill_sigma_m_per_s: float = 0.0
    standstill: StandstillRule = field(default_factory=StandstillRule)
    sideways_sigma_m_per_s: float = 0.0
    mounting_rad: tuple[float, float] = (0.0, 0.0)
    pivot_m: Three = ZERO
    speed_sigma_m_per_s: float = 0.1
    fix_sigma_m: Three = (5.0, 5.0, 10.0)
    fix_velocity_sigma_m_per_s: float = 0.1
    range_sigma_m: float = 0.1
    pseudorange_sigma_m: float = 3.0
    phase_sigma_m: float = 0.01
    least_elevation_rad: float = math.radians(10.0)
    gate_sigma: float = 5.0
    least_sight: float = 0.5
    hidden_excess_m: float = 5.0
    antenna_above_ground_m: float | None = None
    ground_sigma_m: float = 1.0
    gap_acceleration_m_per_s2: float = 2.0
    gap_rate_rad_per_s: float = 1.0
    epsilon: float = 3.0
    smoother: bool = True

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            if one.name.endswith(("sigma_m", "_per_s", "_per_s2", "sigma_rad", "sigma", "_s", "epsilon")):
                zero = one.name in (*OFF_AT_ZERO, "align_s", "imu_late_s")
                worst = min(value) if isinstance(value, tuple) else value
                if one.name != "imu_late_s" and not (worst > 0.0 or (zero and worst == 0.0)):
                    raise MeasurementError(
                        f"{one.name} must be {'zero or more' if zero else 'above zero'}, not {worst}."
                    )
        turned((0.0, 0.0, 0.0), self.axes)
        if not 0.0 <= self.hidden_excess_m < math.inf:
            raise MeasurementError(f"hidden_excess_m must be zero or more, not {self.hidden_excess_m}.")
        if not 0.0 <= self.least_elevation_rad < math.pi / 2.0:
            raise MeasurementError(f"least_elevation_rad must lie in 0…π/2, not {self.least_elevation_rad:g}.")
        if not 0.0 < self.least_sight <= 1.0:
            raise MeasurementError(f"least_sight must be above 0 and at most 1, not {self.least_sight}.")
