"""What a navigation is asked for: what a vehicle measured on a drive, what is known besides, and the map."""

from __future__ import annotations

from collections import Counter
from typing import Annotated, Self

import numpy as np
import numpy.typing as npt
from pydantic import ConfigDict, Field, JsonValue, model_validator

from navigation import MeasurementError
from navigation.drives import DriveLog, Fixes, Ranges, Readings, Speeds
from service.parts.anchors import AnchorId, AnchorIn, CurvatureChoice
from service.parts.map_area import AreaParameters
from service.parts.map_facts import DEM_ID, DemId
from service.parts.points import DegreesNorth, Metres, Number, PointIn, Positive, StrictModel
from service.parts.radios import SightChoice
from service.parts.shapes_in_grid import points_in_grid, resolve_anchor
from terrain import ElevationGrid
from visibility import Anchor

from .receiver import ReceiverIn, satellites_of
from .settings import NavigationSettingsIn

__all__ = [
    "REQUEST",
    "FixIn",
    "NavigationIn",
    "NavigationParameters",
    "RangeIn",
    "ReadingsIn",
    "SpeedIn",
    "drive_of",
    "readings_of",
]

Array = npt.NDArray[np.float64]
Three = tuple[Number, Number, Number]
MOST_READINGS, MOST_MEASUREMENTS = 2_000_000, 500_000
LEAST_READINGS = 2
REQUEST: dict[str, JsonValue] = {
    "dem_id": DEM_ID,
    "readings": {
        "times_s": [0.1 * number for number in range(21)],
        "forces": [[0.0, 0.0, 9.79]] * 21,
        "rates": [[0.0, 0.0, 0.0]] * 21,
    },
    "fixes": [
        {"time_s": 0.0, "east_m": 402300.0, "north_m": 3795200.0, "altitude_m": 1180.0},
        {"time_s": 1.0, "east_m": 402300.0, "north_m": 3795200.0, "altitude_m": 1180.0},
    ],
    "settings": {"imu": "tactical", "heading_deg": 90.0, "standstill_sigma_m_per_s": 0.01},
}


class ReadingsIn(StrictModel):
    """Readings of an inertial unit, one entry for each instant, in the units and axes of the settings."""

    times_s: Annotated[list[Number], Field(min_length=LEAST_READINGS, max_length=MOST_READINGS)] = Field(
        description="When, seconds."
    )
    forces: list[Three] = Field(description="What the accelerometers read along x, y, z: m/s², or g.")
    rates: list[Three] = Field(description="What the gyros read about x, y, z: rad/s, or degrees per second.")

    @model_validator(mode="after")
    def _equally_long(self) -> Self:
        if not len(self.times_s) == len(self.forces) == len(self.rates):
            raise ValueError(
                f"times_s, forces and rates must be equally long, not {len(self.times_s)}, {len(self.forces)} and "
                f"{len(self.rates)}."
            )
        return self


class FixIn(PointIn):
    """A place that a satellite receiver tells, of its antenna; with its velocity, where it tells that."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"time_s": 1.0, "lon_deg": -118.05, "lat_deg": 34.29, "altitude_m": 1180.0}]}
    )

    time_s: Number = Field(description="When, seconds on the clock of the readings.")
    horizontal_sigma_m: Positive | None = Field(None, description="One sigma of east and of north, metres.")
    vertical_sigma_m: Positive | None = Field(None, description="One sigma of the altitude, metres.")
    velocity_m_per_s: Three | None = Field(None, description="True east, north, up, m/s.")
    velocity_sigma_m_per_s: Positive | None = Field(None, description="One sigma of each, m/s.")


class RangeIn(StrictModel):
    """A two-way range."""

    time_s: Number = Field(description="When, seconds on the clock of the readings.")
    anchor_id: AnchorId = Field(description="To which anchor.")
    range_m: Metres = Field(description="Metres; 0 and less is a range that failed.")
    sigma_m: Positive | None = Field(None, description="One sigma, metres; left out = as its anchor says.")


class SpeedIn(StrictModel):
    """A speed of an odometer."""

    time_s: Number = Field(description="When, seconds on the clock of the readings.")
    forward_m_per_s: Number = Field(description="Along the direction of driving, m/s.")


class NavigationParameters(AreaParameters, SightChoice):
    """What a vehicle measured on a drive, and what is known besides."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{name: value for name, value in REQUEST.items() if name != "dem_id"}]}
    )
    sight_alone = "a drive that was driven weighs its ranges by the probability of sight."

    readings: ReadingsIn = Field(description="Of the inertial unit.")
    fixes: Annotated[list[FixIn], Field(max_length=MOST_MEASUREMENTS)] = Field([], description="Of satellites.")
    ranges: Annotated[list[RangeIn], Field(max_length=MOST_MEASUREMENTS)] = Field([], description="To anchors.")
    speeds: Annotated[list[SpeedIn], Field(max_length=MOST_MEASUREMENTS)] = Field([], description="Of an odometer.")
    satellites: ReceiverIn | None = Field(
        None, description="Observations of satellites: their pseudoranges and changes of phase correct the readings."
    )
    anchors: list[AnchorIn] = Field([], description="What is ranged to, with unique ids.")
    settings: NavigationSettingsIn = Field(
        default_factory=lambda: NavigationSettingsIn.model_validate({}), description="What is known besides the log."
    )
    ask_the_map: bool = Field(
        True, strict=True, description="Whether the map tells which ranges to believe, and the ground's height."
    )
    dem_sigma_m: Positive = Field(3.0, description="One-sigma error of the DEM's heights, metres.")
    interval_s: Positive = Field(1.0, description="Between the places that are told, seconds.")
    lat_deg: DegreesNorth | None = Field(None, description="Latitude of a DEM without CRS, degrees north.")
    curvature: CurvatureChoice = Field(
        "auto", description="auto: what the DEM's CRS implies (flat without a CRS); flat: none; or numbers."
    )

    @model_validator(mode="after")
    def _something_corrects_the_readings(self) -> Self:
        ids = [anchor.id for anchor in self.anchors]
        twice = sorted(one for one, times in Counter(ids).items() if times > 1)
        if twice:
            raise ValueError(f"Anchor ids must be unique; repeated: {', '.join(twice[:5])}.")
        strange = next((one.anchor_id for one in self.ranges if one.anchor_id not in set(ids)), None)
        if strange is not None:
            raise ValueError(f"A range goes to {strange!r}, which is no anchor here.")
        if not (self.fixes or self.ranges or self.satellites):
            raise ValueError("Give fixes, ranges or satellites; inertial readings alone lose their way within minutes.")
        return self


class NavigationIn(NavigationParameters):
    """The same on a DEM of the service."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId


def readings_of(asked: NavigationParameters) -> Readings:
    """The inertial readings as arrays, not judged as yet."""
    read = asked.readings
    return Readings(*(np.array(one, np.float64) for one in (read.times_s, read.forces, read.rates)))


def drive_of(grid: ElevationGrid, asked: NavigationParameters) -> tuple[DriveLog, tuple[Anchor, ...], tuple[str, ...]]:
    """(the log in the grid's frame, its anchors, what to know of it in sentences).

    Raises AnchorError, FrameError, MeasurementError, RequestError, AlmanacFileError, GnssInputError, GnssLibraryError.
    """
    anchors = tuple(resolve_anchor(grid, anchor) for anchor in asked.anchors)
    number = {anchor.id: place for place, anchor in enumerate(anchors)}
    readings = readings_of(asked)
    fixes = ranges = speeds = None
    if asked.fixes:
        nothing = (None, None, None)
        fixes = Fixes(
            _numbers([one.time_s for one in asked.fixes]),
            points_in_grid(grid, asked.fixes, "fixes[{}]"),
            _numbers([(one.horizontal_sigma_m, one.horizontal_sigma_m, one.vertical_sigma_m) for one in asked.fixes]),
            _numbers([one.velocity_m_per_s or nothing for one in asked.fixes]),
            _numbers([(one.velocity_sigma_m_per_s,) * 3 for one in asked.fixes]),
        )
    if asked.ranges:
        ranges = Ranges(
            _numbers([one.time_s for one in asked.ranges]),
            np.array([number[one.anchor_id] for one in asked.ranges], np.int64),
            _numbers([one.range_m for one in asked.ranges]),
            _numbers([one.sigma_m for one in asked.ranges]),
        )
    if asked.speeds:
        speeds = Speeds(
            _numbers([one.time_s for one in asked.speeds]), _numbers([one.forward_m_per_s for one in asked.speeds])
        )
    if asked.interval_s * 1e6 < float(np.ptp(readings.times_s)):
        raise MeasurementError("interval_s makes more than a million places; take a longer one.")
    satellites, told = None, tuple[str, ...]()
    if asked.satellites is not None:
        satellites, told = satellites_of(asked.satellites, np.asarray(readings.times_s))
    return DriveLog(readings, fixes, ranges, speeds, satellites=satellites), anchors, told


def _numbers(values: object) -> Array:
    """None becomes NaN."""
    return np.array(values, dtype=np.float64)
