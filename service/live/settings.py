"""What a detector is told before it runs, as requests write it: the fields of ``detection.DetectorSettings``."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from detection import DetectorSettings
from service.parts.points import Metres, Number, Positive, StrictModel

__all__ = ["CalibrationIn", "DetectorSettingsIn"]

DEFAULTS = DetectorSettings()

# Whether a number makes sense is for DetectorSettings to say, in one place.
Count = Annotated[int, Field(strict=True, ge=1, le=1_000_000_000)]
Sigma = "One-sigma error of "


def _degrees(angle_rad: float) -> float:
    """Without the rounding of the way there and back."""
    return round(math.degrees(angle_rad), 9)


class CalibrationIn(StrictModel):
    """By how much ranges are off: a range is scale times the distance plus an offset."""

    scale: Positive = Field(1.0, description="How many times too long ranges are (no unit).")
    offset_m: Metres = Field(0.0, description="How much too long all ranges are, metres.")
    anchor_offsets_m: dict[str, Metres] = Field(
        {}, max_length=62, description="The same by anchor id, metres, in place of offset_m."
    )


class DetectorSettingsIn(StrictModel):
    """What a detector is told before it runs; whatever is left out has its default."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"dimension": 3, "range_sigma_m": 0.1, "max_speed_m_per_s": 3.0}]}
    )

    dimension: Literal[2, 3] = Field(
        DEFAULTS.dimension, description="Number of dimensions: 3, or 2 where all is level."
    )
    range_sigma_m: Number = Field(DEFAULTS.range_sigma_m, description=f"{Sigma}a range, metres.")
    anchor_sigma_m: Number = Field(DEFAULTS.anchor_sigma_m, description=f"{Sigma}an anchor's place, metres.")
    calculation_sigma_m: Number = Field(DEFAULTS.calculation_sigma_m, description=f"{Sigma}the calculation, metres.")
    wheel_sigma_m: Number = Field(DEFAULTS.wheel_sigma_m, description=f"{Sigma}one motion by the wheels, metres.")
    accelerometer_sigma_m: Number = Field(
        DEFAULTS.accelerometer_sigma_m, description=f"{Sigma}one motion by the accelerometer, metres."
    )
    time_sigma_s: Number = Field(DEFAULTS.time_sigma_s, description=f"{Sigma}one clock against the other, seconds.")
    heading_sigma_deg: Number = Field(
        _degrees(DEFAULTS.heading_sigma_rad), description=f"{Sigma}the heading of one motion, degrees."
    )
    heading_offset_sigma_deg: Number = Field(
        _degrees(DEFAULTS.heading_offset_sigma_rad),
        description=f"{Sigma}what all headings are off by at the start, degrees; 180 = they know no north.",
    )
    heading_drift_deg_per_s: Number = Field(
        _degrees(DEFAULTS.heading_drift_rad_per_s),
        description=f"{Sigma}how fast headings drift, degrees per second.",
    )
    k_geometric: Number = Field(DEFAULTS.k_geometric, description="Geometric tolerance as a number of sigmas.")
    k_odometry: Number = Field(DEFAULTS.k_odometry, description="Odometry tolerance as a number of sigmas.")
    geometric_tolerance_m: Number | None = Field(None, description="Geometric tolerance in place of that, metres.")
    odometry_tolerance_m: Number | None = Field(None, description="Odometry tolerance in place of that, metres.")
    harmful_m: Number | None = Field(
        None, description="A range is occluded where it is too long by more than this, metres; null = the tolerance."
    )
    max_range_m: Number = Field(DEFAULTS.max_range_m, description="Longer ranges are rejected, metres.")
    max_speed_m_per_s: Number = Field(
        DEFAULTS.max_speed_m_per_s, description="Faster odometry is not reliable, metres per second."
    )
    window: Annotated[int, Field(strict=True, ge=1, le=1000)] = Field(
        DEFAULTS.window, description="Number of recent epochs in which a violation has to persist."
    )
    persistence: Number = Field(DEFAULTS.persistence, description="In which part of them, 0..1.")
    occlusion_threshold: Number = Field(
        DEFAULTS.occlusion_threshold, description="Fused probability above which an anchor is occluded, 0..1."
    )
    cautious_threshold: Number = Field(
        DEFAULTS.cautious_threshold, description="The same where the witnesses disagree, 0..1."
    )
    terrain: Literal["open", "mixed", "complex"] = Field(
        DEFAULTS.terrain, description="Complex terrain makes the detector more sensitive, open terrain less."
    )
    criticality: Literal["low", "normal", "high"] = Field(
        DEFAULTS.criticality, description="A critical mission makes the detector more sensitive."
    )
    search_limit: Count = Field(DEFAULTS.search_limit, description="Number of sets of ranges tried in one epoch.")
    altitude_hint_m: Number | None = Field(
        None, description="An altitude near the rover's, which settles mirror solutions, metres."
    )
    side_hint_m: tuple[Metres, Metres] | None = Field(
        None, description="A point (east, north, metres) on the rover's side of the anchors, for mirror solutions."
    )
    odometry_offset_s: Number = Field(0.0, description="Seconds that the odometry's clock is ahead.")
    ranging_offset_s: Number = Field(0.0, description="Seconds that the ranging clock is ahead.")
    base_offset_s: Number = Field(0.0, description="Seconds that the base station's clock is ahead.")
    acceleration_m_per_s2: Number = Field(
        DEFAULTS.acceleration_m_per_s2,
        description="How hard the rover usually speeds up, brakes and turns, metres per second squared.",
    )
    vertical_acceleration_m_per_s2: Number = Field(
        DEFAULTS.vertical_acceleration_m_per_s2, description="The same upright, metres per second squared."
    )
    excess_m: Number = Field(DEFAULTS.excess_m, description="How much too long an occluded range typically is, metres.")
    start_m: Annotated[tuple[Metres, ...], Field(min_length=2, max_length=3)] | None = Field(
        None, description="Where the rover starts, if that is known: east, north and, in 3D, altitude, metres."
    )
    start_sigma_m: Number = Field(DEFAULTS.start_sigma_m, description=f"{Sigma}that place, metres.")

    def settings(self) -> DetectorSettings:
        """The same for the detector. Raises DetectionInputError."""
        given = self.model_dump()
        for name in ("heading_sigma", "heading_offset_sigma"):
            given[f"{name}_rad"] = math.radians(given.pop(f"{name}_deg"))
        given["heading_drift_rad_per_s"] = math.radians(given.pop("heading_drift_deg_per_s"))
        return DetectorSettings(**given)
