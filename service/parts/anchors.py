"""Ranging anchors that stand or move, and how sight lines to them are calculated, as requests write it."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Any, Literal, Protocol, Self, runtime_checkable

from pydantic import AfterValidator, ConfigDict, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from service.parts.map_area import AreaParameters
from service.parts.points import InADatum, Metres, NotNegativeMetres, Number, PointIn, Positive, StrictModel
from service.parts.radios import RadioIn, SightChoice
from visibility import AnchorError, AntennaLimits
from visibility.sight.anchors import Covariance

__all__ = [
    "UNSEEN",
    "AnchorId",
    "AnchorIn",
    "AntennaIn",
    "Azimuth",
    "CurvatureChoice",
    "CurvatureIn",
    "FramesIn",
    "SightParameters",
    "TrackIn",
    "TrackPointIn",
]

Azimuth = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-360.0, le=360.0)]
Elevation = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-90.0, le=90.0)]
CovarianceRow = Annotated[list[Number], Field(min_length=3, max_length=3)]
# Ids end up in file tags, tables and pictures: nothing that ends a line, turns the direction of text or cannot be seen.
UNSEEN = r"\x00-\x1f\x7f-\x9f\u2028-\u202e\u2060-\u206f\ufeff\ufff0-\uffff"
PLAIN = rf"^[^\s{UNSEEN}]([^{UNSEEN}]*[^\s{UNSEEN}])?$"
Seconds = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-1e10, le=1e10)]
MOST_FRAMES = 500
MOST_TRACK_POINTS = 10_000


def _plain(id: str) -> str:
    if not re.search(PLAIN, id):
        raise PydanticCustomError(
            "id", "an id has no control characters, no line breaks and no blanks at its beginning and end"
        )
    return id


AnchorId = Annotated[
    str, Field(min_length=1, max_length=64, json_schema_extra={"pattern": PLAIN}), AfterValidator(_plain)
]


class AntennaIn(StrictModel):
    """What is known of a ranging anchor besides its place: its id, and what its antenna can reach."""

    id: AnchorId = Field(description="Name of the anchor, unique in the request, 1 to 64 characters.")
    min_range_m: NotNegativeMetres | None = Field(None, description="Shortest slant range it measures, metres.")
    max_range_m: Metres | None = Field(
        None, description="Longest slant range it measures, metres; left out = unlimited."
    )
    azimuth_from_deg: Azimuth | None = Field(
        None, description="Start of its sector, degrees clockwise from grid north; goes with azimuth_to_deg."
    )
    azimuth_to_deg: Azimuth | None = Field(
        None, description="End of its sector, degrees clockwise from grid north; goes with azimuth_from_deg."
    )
    min_elevation_deg: Elevation | None = Field(
        None, description="Lowest elevation angle it covers, degrees above its horizontal (downwards is negative)."
    )
    max_elevation_deg: Elevation | None = Field(
        None, description="Highest elevation angle it covers, degrees above its horizontal."
    )
    ranging_sigma_m: NotNegativeMetres = Field(0.1, description="One-sigma error of its ranges, metres.")
    pose_sigma_m: NotNegativeMetres = Field(
        0.0, description="One-sigma error of each coordinate of its own position, metres."
    )
    pose_covariance_m2: list[CovarianceRow] | None = Field(
        None,
        min_length=3,
        max_length=3,
        description="Covariance of its own position in place of pose_sigma_m: three rows of east, north, up, in "
        "square metres.",
    )
    radio: RadioIn | None = Field(
        None, description="What it sends and what must arrive, where usable is asked for in place of visible."
    )

    def antenna_limits(self) -> AntennaLimits:
        """The same limits in radians; raises AnchorError when they contradict one another."""
        return AntennaLimits(
            min_range_m=0.0 if self.min_range_m is None else self.min_range_m,
            max_range_m=math.inf if self.max_range_m is None else self.max_range_m,
            azimuth_from_rad=_radians_or_none(self.azimuth_from_deg),
            azimuth_to_rad=_radians_or_none(self.azimuth_to_deg),
            min_elevation_rad=math.radians(-90.0 if self.min_elevation_deg is None else self.min_elevation_deg),
            max_elevation_rad=math.radians(90.0 if self.max_elevation_deg is None else self.max_elevation_deg),
        )

    def pose_covariance(self) -> Covariance | None:
        """Rows of the covariance, m²; None where pose_sigma_m tells all."""
        if self.pose_covariance_m2 is None:
            return None
        (ee, en, eu), (ne, nn, nu), (ue, un, uu) = self.pose_covariance_m2
        return (ee, en, eu), (ne, nn, nu), (ue, un, uu)

    @model_validator(mode="after")
    def _limits_agree(self) -> Self:
        try:
            self.antenna_limits()
        except AnchorError as error:
            raise ValueError(f"{self._called()}: {error}") from error
        return self

    def _called(self) -> str:
        return f"Anchor {self.id}"


class AnchorIn(AntennaIn, PointIn):
    """A ranging anchor: its id, where it is, and what its antenna can reach."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"id": "D1", "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 80.0},
                {"id": "D2", "lon_deg": -118.05, "lat_deg": 34.29, "altitude_m": 1612.0, "max_range_m": 15000.0},
            ]
        }
    )


def _radians_or_none(angle_deg: float | None) -> float | None:
    return None if angle_deg is None else math.radians(angle_deg)


class TrackPointIn(PointIn):
    """Where an anchor on a track is at one time."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"time_s": 60.0, "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 80.0}]
        }
    )

    time_s: Seconds = Field(description="When, seconds on the clock of the frames.")


class TrackIn(AntennaIn):
    """An anchor that moves, straight and even from point to point."""

    points: Annotated[list[TrackPointIn], Field(min_length=1, max_length=MOST_TRACK_POINTS)] = Field(
        description="Where it is when, in ascending time."
    )

    @model_validator(mode="after")
    def _times_ascend(self) -> Self:
        times_s = [point.time_s for point in self.points]
        if any(later <= earlier for earlier, later in pairwise(times_s)):
            raise ValueError(f"Track {self.id}: its points must ascend in time_s.")
        return self


class FramesIn(InADatum):
    """Evenly spaced times, and the height of which availability is told; second 0 is the satellites' time."""

    from_s: Seconds = Field(0.0, description="The first frame, seconds.")
    to_s: Seconds = Field(description="No frame is later, seconds.")
    step_s: Positive = Field(description="From frame to frame, seconds.")
    altitude_m: Metres | None = Field(
        None, description="Availability at this altitude, metres; or give above_ground_m."
    )
    above_ground_m: NotNegativeMetres | None = Field(
        None, description="Availability at this height above ground, metres; left out = the rover's antenna."
    )

    @model_validator(mode="after")
    def _some_frames(self) -> Self:
        if self.to_s < self.from_s:
            raise ValueError(f"Frames must end after they begin, not from {self.from_s:g} to {self.to_s:g} s.")
        if self.altitude_m is not None and self.above_ground_m is not None:
            raise ValueError("Give only one of altitude_m and above_ground_m of the frames.")
        number = self._number()
        if number > MOST_FRAMES:
            raise ValueError(f"{number:,.0f} frames are more than the limit of {MOST_FRAMES}; take a larger step_s.")
        return self

    def times_s(self) -> list[float]:
        """Seconds of each frame."""
        return [self.from_s + number * self.step_s for number in range(int(self._number()))]

    def _number(self) -> float:
        steps = (self.to_s - self.from_s) / self.step_s * (1.0 + 1e-12)
        return math.floor(steps) + 1 if steps < 1e15 else steps


class CurvatureIn(StrictModel):
    """Curvature given by numbers: ground at distance d is lowered by d²/(2·refraction_k·radius_m)."""

    radius_m: Positive = Field(description="Mean radius of the body, metres.")
    refraction_k: Positive = Field(
        1.0, description="Effective-radius factor k, no unit: 4/3 for radio on Earth, 1 without air."
    )


def word_or_numbers(value: Any) -> str:
    """The tag of a field that is a word or an object of numbers."""
    return "<word>" if isinstance(value, str) else "<numbers>"


CurvatureChoice = Annotated[
    Annotated[Literal["auto", "flat"], Tag("<word>")] | Annotated[CurvatureIn, Tag("<numbers>")],
    Discriminator(word_or_numbers),
]


@runtime_checkable
class AskedSources(Protocol):
    """A request with anchors that have a place over the DEM."""

    def near_sources(self) -> Sequence[AntennaIn]:
        """They, in the order of answers."""
        ...


class SightParameters(AreaParameters, SightChoice):
    """Anchors, and how sight lines to them are calculated."""

    anchors: list[AnchorIn] = Field([], description="The anchors, with unique ids.")
    mode: Literal["fast", "exact"] = Field(
        "fast", description="fast: the column sweep, with its stated error; exact: every edge that the line crosses."
    )
    unknown: Literal["unknown", "open", "blocked"] = Field(
        "unknown", description="What a sight line over unknown ground is, unless known ground blocks it already."
    )
    curvature: CurvatureChoice = Field(
        "auto", description="auto: what the DEM's CRS implies (flat without a CRS); flat: none; or numbers."
    )

    def near_sources(self) -> tuple[AntennaIn, ...]:
        """All that has a place over the DEM, in the order of answers."""
        return tuple(self.anchors)

    def without_radio(self) -> list[str]:
        """Ids of anchors without a radio."""
        return [anchor.id for anchor in self.near_sources() if anchor.radio is None]

    @model_validator(mode="after")
    def _unique_ids(self) -> Self:
        ids = [anchor.id for anchor in self.near_sources()]
        twice = sorted(id for id, times in Counter(ids).items() if times > 1)
        if twice:
            raise ValueError(f"Anchor ids must be unique; repeated: {', '.join(twice[:5])}.")
        return self
