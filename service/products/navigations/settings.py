"""What is known of a drive besides its log, as requests and settings files write it: fields of ``DriveSettings``."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import ConfigDict, Discriminator, Field, Tag

from navigation.drives import DriveSettings
from navigation.inertial import IMU_PRESETS, ImuNoise, StandstillRule, deg_per_h, deg_per_sqrt_h, milli_g
from service.parts.anchors import word_or_numbers
from service.parts.points import Metres, NotNegative, NotNegativeMetres, Number, Positive, StrictModel

__all__ = ["ImuNoiseIn", "NavigationSettingsIn"]

DEFAULTS = DriveSettings()
Three = tuple[Metres, Metres, Metres]
Unit = Literal["ADIS16405", "Leador-A15", "H764G", "tactical", "lower"]
Share = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0, le=1.0)]
OFF = "0 = off"


def _degrees(angle_rad: float) -> float:
    """Without the rounding of the way there and back."""
    return round(math.degrees(angle_rad), 9)


class ImuNoiseIn(StrictModel):
    """The errors of an inertial unit in the units of its datasheet, one sigma of each axis."""

    velocity_walk_m_per_s_sqrt_h: Positive = Field(description="White noise of the forces, metres per second per √h.")
    angle_walk_deg_per_sqrt_h: Positive = Field(description="White noise of the turn rates, degrees per √h.")
    force_bias_mg: Positive = Field(description="Bias of the accelerometers at the start, number of thousandths of g.")
    rate_bias_deg_per_h: Positive = Field(description="Bias of the gyros at the start, degrees per hour.")
    force_wander_mg: NotNegative = Field(0.0, description="How that bias wanders, number of thousandths of g.")
    rate_wander_deg_per_h: NotNegative = Field(0.0, description="How that bias wanders, degrees per hour.")
    correlation_s: Positive = Field(3600.0, description="Correlation time of the wandering, seconds.")
    force_scale_ppm: NotNegative = Field(
        0.0, description="Scale factor of the accelerometers, number of 1e-6; 0 = exact."
    )
    rate_scale_ppm: NotNegative = Field(0.0, description="Scale factor of the gyros, number of 1e-6; 0 = exact.")
    force_range_g: Positive | None = Field(
        None, description="Saturation of the accelerometers, number of g; null = none."
    )
    rate_range_deg_per_s: Positive | None = Field(
        None, description="Saturation of the gyros, degrees per second; null = none."
    )

    def noise(self) -> ImuNoise:
        """The same for the filter."""
        return ImuNoise(
            self.velocity_walk_m_per_s_sqrt_h / 60.0,
            deg_per_sqrt_h(self.angle_walk_deg_per_sqrt_h),
            milli_g(self.force_bias_mg),
            deg_per_h(self.rate_bias_deg_per_h),
            milli_g(self.force_wander_mg),
            deg_per_h(self.rate_wander_deg_per_h),
            self.correlation_s,
            1e-6 * self.force_scale_ppm,
            1e-6 * self.rate_scale_ppm,
            math.inf if self.force_range_g is None else milli_g(1000.0 * self.force_range_g),
            math.inf if self.rate_range_deg_per_s is None else math.radians(self.rate_range_deg_per_s),
        )


UnitOrNumbers = Annotated[
    Annotated[Unit, Tag("<word>")] | Annotated[ImuNoiseIn, Tag("<numbers>")], Discriminator(word_or_numbers)
]


class NavigationSettingsIn(StrictModel):
    """The unit and how it is mounted, where the drive begins, what is believed how far; what is left out has its
    default."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"imu": "ADIS16405", "axes": "frd", "standstill_sigma_m_per_s": 0.01}]}
    )

    imu: UnitOrNumbers = Field("tactical", description="A preset from a datasheet, or numbers.")
    # the filter's own sentence says more than a pattern
    axes: Annotated[str, Field(max_length=20, json_schema_extra={"pattern": "^[fblrud]{3}$"})] | None = Field(
        None,
        description="Where x, y and z of the unit point: forward, back, left, right, up, down; left out = as the log's "
        "kind has them, else flu.",
    )
    force_unit: Literal["m/s2", "g"] | None = Field(None, description="Of forces; left out = m/s2.")
    rate_unit: Literal["rad/s", "deg/s"] | None = Field(None, description="Of turn rates; left out = rad/s.")
    imu_late_s: Number = Field(DEFAULTS.imu_late_s, description="How much later readings are stamped, seconds.")
    max_gap_s: NotNegative = Field(
        DEFAULTS.max_gap_s, description="A longer step is a gap, seconds; 0 = ten times the median step."
    )
    lever_arm_m: Three = Field(
        DEFAULTS.lever_arm_m, description="From the unit to the antenna: forward, left, up, metres."
    )
    lever_arm_sigma_m: NotNegativeMetres = Field(
        DEFAULTS.lever_arm_sigma_m, description="One sigma of it, metres; 0 = it is not estimated."
    )
    align_s: NotNegative = Field(DEFAULTS.align_s, description="The beginning that levels the unit, seconds.")
    heading_deg: Number | None = Field(
        None, description="At the beginning, degrees clockwise from grid north; left out = as the log tells it."
    )
    heading_sigma_deg: Positive = Field(_degrees(DEFAULTS.heading_sigma_rad), description="One sigma of it, degrees.")
    position_m: Three | None = Field(
        None, description="East, north, altitude at the beginning, metres; left out = as the log tells it."
    )
    position_sigma_m: Positive = Field(DEFAULTS.position_sigma_m, description="One sigma of each axis, metres.")
    velocity_sigma_m_per_s: Positive = Field(
        DEFAULTS.velocity_sigma_m_per_s, description="One sigma of the velocity at the beginning, m/s."
    )
    standstill_sigma_m_per_s: NotNegative = Field(
        DEFAULTS.standstill_sigma_m_per_s,
        description=f"Of zero velocity where readings are still (ZUPT), m/s; {OFF}.",
    )
    still_force_m_per_s2: Positive = Field(
        DEFAULTS.standstill.force_sigma_m_per_s2, description="Forces of a still unit vary by no more, metres/s²."
    )
    still_rate_rad_per_s: Positive = Field(
        DEFAULTS.standstill.rate_sigma_rad_per_s, description="Turn rates of a still unit vary by no more, rad/s."
    )
    still_s: Positive = Field(DEFAULTS.standstill.window_s, description="Over so many seconds.")
    sideways_sigma_m_per_s: NotNegative = Field(
        DEFAULTS.sideways_sigma_m_per_s,
        description=f"Of going neither sideways nor off the ground (non-holonomic constraint), m/s; {OFF}.",
    )
    driving_left_deg: Number = Field(
        0.0, description="How far the direction of driving lies left of the unit's forward, degrees."
    )
    driving_up_deg: Number = Field(
        0.0, description="How far the direction of driving lies above the unit's forward, degrees."
    )
    pivot_m: Three = Field(
        DEFAULTS.pivot_m,
        description="From the unit to amid the wheels, where speeds are told and nothing slides: forward, left, up, "
        "metres.",
    )
    speed_sigma_m_per_s: Positive = Field(DEFAULTS.speed_sigma_m_per_s, description="One sigma of speeds, m/s.")
    fix_sigma_m: tuple[Positive, Positive, Positive] = Field(
        DEFAULTS.fix_sigma_m, description="Of fixes that tell none: east, north, up, metres."
    )
    fix_velocity_sigma_m_per_s: Positive = Field(
        DEFAULTS.fix_velocity_sigma_m_per_s, description="Of their velocities that tell none, m/s."
    )
    pseudorange_sigma_m: Positive = Field(
        DEFAULTS.pseudorange_sigma_m, description="One sigma of the code of a satellite in the zenith, metres."
    )
    phase_sigma_m: NotNegativeMetres = Field(
        DEFAULTS.phase_sigma_m,
        description="One sigma of the carrier phase of a satellite in the zenith, metres; 0 = phases are not used.",
    )
    least_elevation_deg: Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.0, lt=90.0)] = Field(
        _degrees(DEFAULTS.least_elevation_rad), description="Satellites that stand lower are left out, degrees."
    )
    gate_sigma: Positive = Field(
        DEFAULTS.gate_sigma, description="What lies further off than so many sigmas is not believed, no unit."
    )
    least_sight: Share = Field(
        DEFAULTS.least_sight, description="Ranges of less probability of sight are left out, 0..1."
    )
    hidden_excess_m: NotNegativeMetres = Field(
        DEFAULTS.hidden_excess_m,
        description="How much too long a range over a detour is in the mean, metres: the less likely one is in sight, "
        "the less sure it is by that. 0 = its variance is divided by the probability.",
    )
    antenna_above_ground_m: NotNegativeMetres | None = Field(
        None,
        description="Of the antenna of a vehicle on the ground, metres: then the map tells its height; left out = it "
        "flies.",
    )
    gap_acceleration_m_per_s2: Positive = Field(
        DEFAULTS.gap_acceleration_m_per_s2, description="How the vehicle may be pushed within a gap, metres/s²."
    )
    gap_rate_rad_per_s: Positive = Field(
        DEFAULTS.gap_rate_rad_per_s, description="How it may turn within a gap, rad/s."
    )
    epsilon: Positive = Field(DEFAULTS.epsilon, description="How many sigmas the bubble's radius is, no unit.")
    smoother: bool = Field(
        DEFAULTS.smoother, strict=True, description="Whether the track is smoothed back through the whole log."
    )

    def settings(self) -> DriveSettings:
        """The same for the filter. Raises MeasurementError."""
        given = self.model_dump(
            include={name for name in type(self).model_fields if name in DriveSettings.__dataclass_fields__}
        )
        given["imu"] = IMU_PRESETS[self.imu] if isinstance(self.imu, str) else self.imu.noise()
        for name in ("axes", "force_unit", "rate_unit"):
            given[name] = given[name] or getattr(DEFAULTS, name)
        return DriveSettings(
            **given,
            heading_rad=None if self.heading_deg is None else math.radians(self.heading_deg),
            heading_sigma_rad=math.radians(self.heading_sigma_deg),
            least_elevation_rad=math.radians(self.least_elevation_deg),
            mounting_rad=(math.radians(self.driving_left_deg), math.radians(self.driving_up_deg)),
            standstill=StandstillRule(self.still_force_m_per_s2, self.still_rate_rad_per_s, window_s=self.still_s),
        )
