"""Epochs of ranges and the anchors they go to, as requests and streams write them."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from detection import OdometryIncrement, RangeEpoch, RangeMeasurement, RangingAnchor
from service.live.drives import DriveIn
from service.live.imu import ImuIn, InertialUnitIn
from service.live.settings import CalibrationIn, DetectorSettingsIn
from service.parts.anchors import AnchorId
from service.parts.doubts import DoubtParameters
from service.parts.map_area import AreaParameters
from service.parts.points import Metres, NotNegativeMetres, Positive, StrictModel
from service.parts.radios import RadioIn

__all__ = [
    "ANCHORS",
    "RANGES",
    "DetectionIn",
    "DetectorIn",
    "EpochIn",
    "EpochsIn",
    "RangeIn",
    "RangingAnchorIn",
]

# What a sensor delivers is not refused: a range that is no number or not positive is counted by the detector.
Measured = Annotated[float, Field(strict=True)]
Seconds = Annotated[float, Field(strict=True)]

ANCHORS: list[Any] = [
    {"id": "D1", "east_m": 0.0, "north_m": 0.0, "altitude_m": 120.0},
    {"id": "D2", "east_m": 400.0, "north_m": 30.0, "altitude_m": 60.0},
    {"id": "D3", "east_m": 380.0, "north_m": 420.0, "altitude_m": 140.0},
    {"id": "D4", "east_m": -20.0, "north_m": 390.0, "altitude_m": 80.0},
    {"id": "D5", "east_m": 240.0, "north_m": 150.0, "altitude_m": 160.0},
    {"id": "D6", "east_m": 90.0, "north_m": 250.0, "altitude_m": 40.0},
]
RANGES: list[Any] = [
    {"anchor_id": "D1", "range_m": 248.926},
    {"anchor_id": "D2", "range_m": 287.687},
    {"anchor_id": "D3", "range_m": 374.038},
    {"anchor_id": "D4", "range_m": 299.079},
    {"anchor_id": "D5", "range_m": 182.165, "sigma_m": 0.05},
    {"anchor_id": "D6", "range_m": 114.948, "p_sight": 0.9},
]


class RangingAnchorIn(StrictModel):
    """An anchor of a detector: its id and where it is, in any metric frame that is level."""

    model_config = ConfigDict(json_schema_extra={"examples": ANCHORS[:1]})

    id: AnchorId = Field(description="Name of the anchor, unique in the request, 1 to 64 characters.")
    east_m: Metres = Field(description="East, metres.")
    north_m: Metres = Field(description="North, metres.")
    altitude_m: Metres | None = Field(None, description="Height, metres; may be left out in two dimensions only.")
    sigma_m: NotNegativeMetres = Field(0.0, description="One-sigma error of its place along a range, metres.")

    radio: RadioIn | None = Field(
        None,
        description="Of a session that looks at a DEM: what it sends and what must arrive, over ground and through the "
        "canopy of its cover. What is foretold of its ranges is then of the signal too. null = of sight alone.",
    )

    def anchor(self) -> RangingAnchor:
        """The same for the detector."""
        return RangingAnchor(self.id, self.east_m, self.north_m, self.altitude_m or 0.0, self.sigma_m)


class RangeIn(StrictModel):
    """One measured range. A range that cannot be used is not refused but counted, and named in the answer."""

    model_config = ConfigDict(json_schema_extra={"examples": RANGES[4:]})

    anchor_id: str = Field(max_length=64, description="Which anchor.")
    range_m: Measured | None = Field(description="Measured range, metres; null: measured, but not a number.")
    sigma_m: Measured | None = Field(None, description="One-sigma error, metres; left out = that of the settings.")
    p_sight: Measured | None = Field(
        None, description="Predicted probability that the anchor is in sight, 0..1, from wherever; null = none."
    )
    time_s: Seconds | None = Field(None, description="When it was measured, seconds; left out = the epoch's time.")

    def measurement(self) -> RangeMeasurement:
        """The same for the detector."""
        range_m = math.nan if self.range_m is None else self.range_m
        return RangeMeasurement(self.anchor_id, range_m, self.sigma_m, self.p_sight, self.time_s)


class OdometryIn(StrictModel):
    """Motion between the previous epoch and this one, by wheels, by accelerometer, or by both."""

    duration_s: Seconds = Field(description="How long the motion took, seconds.")
    wheel_m: tuple[Measured, Measured] | None = Field(
        None,
        description="Displacement by the wheel encoders in the rover's own level frame: forward and to the left, "
        "metres. Its length counts; where it led is for heading_deg to say.",
    )
    accelerometer_m: tuple[Measured, Measured, Measured] | None = Field(
        None,
        description="Displacement by the accelerometer, integrated, in the same frame: forward, left and up, metres.",
    )
    heading_deg: Measured | None = Field(
        None,
        description="Direction of the motion (where it led, not where the nose points: backwards it is the tail's), "
        "degrees clockwise from the anchors' north; null = unknown. The ranges say by how much it is off and how it "
        "drifts; one that contradicts them is not used, and the answer says so.",
    )

    def increment(self) -> OdometryIncrement:
        """The same for the detector, in radians."""
        heading_rad = None if self.heading_deg is None else math.radians(self.heading_deg)
        return OdometryIncrement(self.duration_s, self.wheel_m, self.accelerometer_m, heading_rad)


class EpochIn(StrictModel):
    """Ranges that belong together, and the motion since the epoch before."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"time_s": 12.0, "sequence": 12, "ranges": RANGES}]})

    time_s: Seconds = Field(description="Seconds on the ranging clock, with any origin; the end of the round.")
    ranges: list[RangeIn] = Field(description="The ranges; may be empty.")
    odometry: OdometryIn | None = Field(None, description="The motion since the epoch before; null = unknown.")
    sequence: Annotated[int, Field(strict=True, ge=-(2**63), lt=2**63)] | None = Field(
        None, description="The sender's number of this epoch; a repeated number is a duplicate."
    )
    imu: ImuIn | None = Field(
        None, description="Readings of an inertial unit up to this epoch, for the estimator inertial; null = none."
    )
    moved: list[RangingAnchorIn] = Field(
        [], description="Anchors of the session that are elsewhere from now on; each keeps its radio."
    )

    def epoch(self) -> RangeEpoch:
        """The same for the detector."""
        return RangeEpoch(
            self.time_s,
            tuple([measured.measurement() for measured in self.ranges]),
            None if self.odometry is None else self.odometry.increment(),
            self.sequence,
            tuple([anchor.anchor() for anchor in self.moved]),
        )

    @model_validator(mode="after")
    def _radios_stay(self) -> Self:
        heard = [anchor.id for anchor in self.moved if anchor.radio is not None]
        if heard:
            raise ValueError(f"An anchor that moves keeps its radio: leave out that of {heard[0]}.")
        return self


class EpochsIn(StrictModel):
    """Epochs of a session, oldest first."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"epochs": [{"time_s": 12.0, "ranges": RANGES}]}]})

    epochs: list[EpochIn] = Field(min_length=1, description="One epoch or several, oldest first.")


class _Detector(StrictModel):
    anchors: list[RangingAnchorIn] = Field(description="The anchors; their ids are unique.")
    settings: DetectorSettingsIn = Field(
        DetectorSettingsIn.model_validate({}), description="What the detector is told; left out = the defaults."
    )

    @model_validator(mode="after")
    def _ids_are_unique_and_heights_are_there(self) -> Self:
        seen: set[str] = set()
        for anchor in self.anchors:
            if anchor.id in seen:
                raise ValueError(f"Anchor ids must be unique; {anchor.id} comes twice.")
            seen.add(anchor.id)
            if anchor.altitude_m is None and self.settings.dimension == 3:
                raise ValueError(f"Anchor {anchor.id}: in three dimensions altitude_m is needed.")
        return self

    def _refuse_radios(self, why: str) -> None:
        heard = [anchor.id for anchor in self.anchors if anchor.radio is not None]
        if heard:
            raise ValueError(f"Anchor {heard[0]}: a radio is heard over a DEM; {why}.")


class DetectionIn(_Detector):
    """One epoch by itself: anchors, ranges, settings."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"anchors": ANCHORS, "ranges": RANGES}]})

    ranges: list[RangeIn] = Field(description="The ranges of the epoch; may be empty.")
    time_s: Seconds = Field(0.0, description="When, seconds; comes back in the answer.")

    @model_validator(mode="after")
    def _no_radios(self) -> Self:
        self._refuse_radios("an epoch by itself looks at none, so leave it out")
        return self

    def epoch(self) -> RangeEpoch:
        """The epoch for the detector."""
        return RangeEpoch(self.time_s, tuple(measured.measurement() for measured in self.ranges))


class DetectorIn(_Detector, AreaParameters, DoubtParameters):
    """A session: anchors, settings, how long it may lie idle; of an area its DEM is asked while the rover is in it."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"anchors": ANCHORS, "settings": {"range_sigma_m": 0.1}, "name": "rover 7"}]}
    )

    name: str | None = Field(None, max_length=200, description="A name for people; comes back in answers.")
    dem_id: str | None = Field(
        None,
        max_length=64,
        description="A DEM that the session looks at: it then foretells each anchor's sight and the ground's height. "
        "The anchors are in the DEM's CRS, their altitudes in its vertical datum. null = no map.",
    )
    antenna_above_ground_m: NotNegativeMetres = Field(1.5, description="Of the rover on the DEM's ground, metres.")
    dem_sigma_m: Positive = Field(3.0, description="One-sigma error of the DEM's heights, metres.")
    dem_correlation_m: Positive = Field(100.0, description="Distance over which that error falls off, metres.")
    dem_shift_sigma_m: NotNegativeMetres | None = Field(
        None, description="One-sigma error of where the DEM lies, per axis, metres; null = half a cell."
    )
    calibration: CalibrationIn | None = Field(None, description="Is applied to every range first; null = none.")
    estimator: Literal["constant_velocity", "hypotheses", "inertial"] | None = Field(
        None,
        description="A filter that goes along, in three dimensions: answers then hold its estimate of place and "
        "velocity from ranges, odometry and the DEM's height together. constant_velocity weighs ranges by the "
        "verdicts; hypotheses carries which ranges may lie, so that its bubble holds; inertial takes the imu of its "
        "epochs. null = none.",
    )
    imu: InertialUnitIn | None = Field(None, description="The unit of the estimator inertial; null = its defaults.")
    drive: DriveIn | None = Field(None, description="The path to follow, for advice; needs dem_id. null = none.")
    idle_timeout_s: Annotated[float, Field(strict=True, gt=0.0, allow_inf_nan=False)] | None = Field(
        None, description="Seconds without a request after which it expires; left out = the most that is allowed."
    )

    @model_validator(mode="after")
    def _an_area_of_a_dem(self) -> Self:
        if self.area is not None and self.dem_id is None:
            raise ValueError("An area is one of a DEM: give dem_id too, or leave out area.")
        if self.cover is not None and self.dem_id is None:
            raise ValueError("A cover stands on a DEM: give dem_id too, or leave out cover.")
        if self.doubts is not None and self.dem_id is None:
            raise ValueError("Doubts are about a DEM: give dem_id too, or leave out doubts.")
        if self.imu is not None and self.estimator != "inertial":
            raise ValueError("imu is of the estimator inertial: ask for that too, or leave out imu.")
        if self.dem_id is None:
            self._refuse_radios("give dem_id too, or leave it out")
        return self
