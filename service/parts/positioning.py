"""What maps of positioning are asked for: anchors and satellites, the dilution of precision and its limit."""

from __future__ import annotations

from datetime import date
from typing import Annotated, Literal, Self

from pydantic import AwareDatetime, Field, JsonValue, model_validator

from service.parts.anchors import AntennaIn, FramesIn, SightParameters, TrackIn
from service.parts.doubts import DoubtParameters
from service.parts.map_facts import DEM_ID
from service.parts.points import DegreesEast, DegreesNorth, InADatum, Metres, NotNegativeMetres, Positive, StrictModel

__all__ = [
    "AREA_BESIDE",
    "EXAMPLE_ANCHORS",
    "ORBIT_TEXTS",
    "POSITIONING_EXAMPLE",
    "CeilingParameters",
    "MorphingMapParameters",
    "PositioningParameters",
    "RangingParameters",
    "SatellitesIn",
]

# A YUMA almanac of 63 satellites takes 40 kB, the GPS navigation file of a day 300 kB.
ALMANAC_CHARACTERS, NAVIGATION_CHARACTERS = 200_000, 1_000_000
# fields that answers leave out: long, and nobody reads them there
ORBIT_TEXTS = frozenset({"almanac", "navigation"})
AREA_BESIDE = "The area of a plan stands beside its morphing_map, not in it; move it there."
EXAMPLE_ANCHORS: list[JsonValue] = [
    {"id": "D1", "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 120.0},
    {"id": "D2", "east_m": 409800.0, "north_m": 3798100.0, "above_ground_m": 200.0},
    {"id": "D3", "east_m": 405100.0, "north_m": 3801700.0, "altitude_m": 1612.0},
]
POSITIONING_EXAMPLE: dict[str, JsonValue] = {
    "dem_id": DEM_ID,
    "anchors": EXAMPLE_ANCHORS,
    "kind": "ranging",
    "measure": "pdop",
}


class SatellitesIn(StrictModel):
    """GPS satellites at one time, from the text of an almanac or of a navigation file."""

    almanac: str | None = Field(
        None,
        min_length=1,
        max_length=ALMANAC_CHARACTERS,
        description="Text of a SEM or YUMA almanac file, good to about a kilometre; or give navigation.",
    )
    navigation: str | None = Field(
        None,
        min_length=1,
        max_length=NAVIGATION_CHARACTERS,
        description="Text of a RINEX 2 or 3 navigation file, good to metres within 2 h of its sets; or give almanac.",
    )
    time: AwareDatetime = Field(description="When, ISO 8601 with its offset, such as 2007-01-27T06:00:00Z.")
    reference_date: date | None = Field(
        None, description="A date near the almanac's; needed where it counts weeks modulo 1024, as nearly all do."
    )
    cone_deg: Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0, le=90.0)] = Field(
        85.0, description="Half-angle of the cone round the zenith that satellites are taken from, degrees."
    )
    ranging_sigma_m: NotNegativeMetres = Field(1.0, description="One-sigma error of their ranges, metres.")
    lon_deg: DegreesEast | None = Field(
        None, description="Longitude of a DEM without CRS, degrees east; its north is taken for true. With lat_deg."
    )
    lat_deg: DegreesNorth | None = Field(None, description="Latitude of a DEM without CRS, degrees north.")

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.almanac is None) == (self.navigation is None):
            given = "neither was" if self.almanac is None else "both were"
            raise ValueError(f"Give exactly one of almanac and navigation for the satellites; {given} given.")
        return self

    @model_validator(mode="after")
    def _whole_place(self) -> Self:
        if (self.lon_deg is None) != (self.lat_deg is None):
            raise ValueError("Give both of lon_deg and lat_deg of the satellites' place, or neither.")
        return self


class RangingParameters(SightParameters, DoubtParameters):
    """What is ranged to: anchors, satellites, or both."""

    satellites: SatellitesIn | None = Field(None, description="GPS satellites, besides the anchors or in their place.")

    @model_validator(mode="after")
    def _anchors_alone_are_usable(self) -> Self:
        if self.usable and self.satellites is not None:
            raise ValueError("What is usable is known of anchors alone; leave out satellites, or ask for visible.")
        return self


class PositioningParameters(RangingParameters):
    """Anchors, satellites, and how good positioning must be."""

    kind: Literal["ranging", "pseudorange", "tdoa"] = Field(
        "ranging", description="What is measured: ranges; ranges with an unknown clock; differences of arrival."
    )
    measure: Literal["gdop", "pdop", "hdop", "vdop", "tdop"] = Field(
        "pdop", description="Which dilution of precision; tdop, of the clock, goes with pseudoranges."
    )
    dop_limit: Positive = Field(2.5, description="From this dilution on positioning is not good enough, no unit.")
    min_anchors: Annotated[int, Field(strict=True, ge=1, le=1024)] | None = Field(
        None, description="So many anchors must be in sight as well; left out = as many as a fix needs."
    )

    @model_validator(mode="after")
    def _something_to_range_to(self) -> Self:
        if not self.near_sources() and self.satellites is None:
            raise ValueError("Give anchors or satellites; there is nothing to range to.")
        return self

    @model_validator(mode="after")
    def _a_clock_for_tdop(self) -> Self:
        if self.measure == "tdop" and self.kind != "pseudorange":
            raise ValueError(f"measure 'tdop' needs kind 'pseudorange'; {self.kind!r} solves for no clock.")
        return self


class CeilingParameters(PositioningParameters, InADatum):
    """How good positioning must be in the air, up to a ceiling."""

    altitude_fields = ("ceiling_altitude_m",)

    ceiling_altitude_m: Metres | None = Field(
        None, description="Top of the air, metres above altitude_datum; or give ceiling_above_ground_m."
    )
    ceiling_above_ground_m: Positive | None = Field(
        None, description="Top of the air above the ground of each post, metres; or give ceiling_altitude_m."
    )

    @model_validator(mode="after")
    def _one_ceiling(self) -> Self:
        if (self.ceiling_altitude_m is None) == (self.ceiling_above_ground_m is None):
            given = "neither was" if self.ceiling_altitude_m is None else "both were"
            raise ValueError(f"Give exactly one of ceiling_altitude_m and ceiling_above_ground_m; {given} given.")
        return self

    def ceiling(self) -> tuple[float, bool]:
        """(metres, whether they count from the ground)."""
        if self.ceiling_above_ground_m is not None:
            return self.ceiling_above_ground_m, True
        assert self.ceiling_altitude_m is not None, "the validator has seen to it"
        return self.ceiling_altitude_m, False


class MorphingMapParameters(CeilingParameters):
    """Above which altitude positioning is good enough, up to a ceiling."""

    receiver_above_ground_m: NotNegativeMetres = Field(
        1.5, description="Height of a ground rover's antenna, metres; no_go.geojson and contours.geojson are for it."
    )
    surface_layer_m: Positive | None = Field(
        None,
        description="Thickness of the voxels that surface.glb and surface.stl are made from, metres; left out = the "
        "DEM's smaller cell, and at most 100 layers.",
    )
    tracks: list[TrackIn] = Field([], description="Anchors that move; they need frames, all of them within the tracks.")
    frames: FramesIn | None = Field(
        None,
        description="The map at several times: frames as GeoTIFFs and as an animation, and from when to when each "
        "place is available. All other files are of the first of them.",
    )

    def near_sources(self) -> tuple[AntennaIn, ...]:
        """Anchors, then tracks."""
        return (*self.anchors, *self.tracks)

    @model_validator(mode="after")
    def _frames_for_tracks(self) -> Self:
        if self.tracks and self.frames is None:
            raise ValueError("Anchors on tracks need frames; say from when to when.")
        return self
