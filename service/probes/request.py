"""What is asked about single places and lines, and what they are answered with at once."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, JsonValue, model_validator

from service.parts.anchors import AnchorIn, CurvatureChoice, SightParameters
from service.parts.doubts import DoubtParameters
from service.parts.map_area import AreaParameters
from service.parts.map_facts import DEM_ID, DemId
from service.parts.points import Metres, NotNegativeMetres, PlaceIn, Positive
from service.parts.radios import RadioIn
from service.products.lines_of_sight.calculate import BlockingPoint
from service.products.lines_of_sight.request import FROM, TO, PairIn

__all__ = [
    "MOST_PLACES",
    "MOST_POINTS",
    "MOST_PROFILES",
    "PREVIEW_FILE",
    "AnchorSeen",
    "DilutionProbed",
    "PlaceProbed",
    "PreviewIn",
    "PreviewTold",
    "ProbeIn",
    "ProbeOut",
    "ProfileOut",
    "ProfilesIn",
    "ProfilesOut",
    "SignalTold",
]

# what a preview is called in its work folder, for as long as it takes to hand it on
PREVIEW_FILE = "preview.bin"
MOST_POINTS, MOST_PROFILES, MOST_PLACES = 100, 64, 4096
ANCHORS: list[JsonValue] = [{"id": "D1", "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 120.0}]
POINTS: list[JsonValue] = [{"east_m": 398100.0, "north_m": 3791700.0}]


class ProbeIn(SightParameters, DoubtParameters):
    """Places on a DEM, and the anchors that may be seen from there."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"dem_id": DEM_ID, "points": POINTS, "anchors": ANCHORS}]}
    )

    dem_id: DemId
    points: Annotated[list[PlaceIn], Field(min_length=1, max_length=MOST_POINTS)] = Field(
        description="Places, at least one, in metres or degrees."
    )
    receiver_above_ground_m: NotNegativeMetres | None = Field(
        None, description="Height of the receiver above the ground, metres; 1.5 where neither height is given."
    )
    receiver_altitude_m: Metres | None = Field(
        None, description="Altitude of the receiver in the DEM's vertical datum, metres, in place of that."
    )
    kind: Literal["ranging", "pseudorange", "tdoa"] = Field(
        "ranging", description="What is measured: ranges; ranges with an unknown clock; differences of arrival."
    )
    on_surface: bool = Field(
        False, description="Whether the receiver moves on the ground, so that only motion along it is unknown."
    )
    dem_sigma_m: Positive | None = Field(
        None, description="Asks for the probability of sight under this one-sigma height error of the DEM, metres."
    )

    @model_validator(mode="after")
    def _one_height(self) -> Self:
        if self.receiver_above_ground_m is not None and self.receiver_altitude_m is not None:
            raise ValueError("Give only one of receiver_above_ground_m and receiver_altitude_m.")
        return self


class PreviewIn(SightParameters, DoubtParameters):
    """A DEM, anchors, and what of them is wanted over every post."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"dem_id": DEM_ID, "anchors": ANCHORS, "level": 2}]})

    dem_id: DemId
    anchors: list[AnchorIn] = Field(min_length=1, description="The anchors, at least one, with unique ids.")
    level: Annotated[int, Field(strict=True, ge=0, le=30)] = Field(
        0, description="Resolution level, as `/dems/{dem_id}/levels` lists them; 0 has the posts themselves."
    )
    show: Literal["sight", "needed_height", "dop", "position_error", "margin_db"] = Field(
        "sight",
        description="sight: by anchor, the lowest altitude in its sight (its signal's, where usable is asked for) and "
        "reach, metres; needed_height: the same above the ground of the level; dop: one dilution, no unit; "
        "position_error: one sigma in space, metres; margin_db: by anchor, what of its signal is beyond the "
        "receiver's need, dB, for which usable has to be asked for.",
    )
    receiver_above_ground_m: NotNegativeMetres = Field(
        1.5,
        description="Height of the receiver above the ground, metres: for dop, error, margin, and the reach of "
        "antennas.",
    )
    kind: Literal["ranging", "pseudorange", "tdoa"] = Field(
        "ranging", description="What is measured: ranges; ranges with an unknown clock; differences of arrival."
    )
    measure: Literal["gdop", "pdop", "hdop", "vdop"] = Field("pdop", description="Which dilution.")
    on_surface: bool = Field(False, description="Whether only motion along the ground is unknown.")

    @model_validator(mode="after")
    def _margins_are_of_signals(self) -> Self:
        if self.show == "margin_db" and not self.usable:
            raise ValueError('margin_db is of signals: ask with sight "usable", and a radio for every anchor.')
        return self


class PreviewTold(BaseModel):
    """The first line of the answer, JSON: what the numbers after it are."""

    names: list[str] = Field(description="What each array is of: the anchors' ids, or what was asked to be shown.")
    rows: int = Field(description="Rows of each array, north to south.")
    cols: int = Field(description="Columns of each array, west to east.")
    mode: str = Field(description="fast or exact.")
    error_statement: str = Field(description="Measured error of that mode.")
    curvature: str = Field(description="Curvature and refraction that were used.")
    warnings: list[str] = Field(description="What to know before trusting it, in sentences.")


class ProfilesIn(AreaParameters):
    """Pairs of points on a DEM; what lies under and around the straight line between them is wanted."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"dem_id": DEM_ID, "pairs": [{"from": FROM, "to": TO}], "wavelength_m": 0.125}]}
    )

    dem_id: DemId
    pairs: Annotated[list[PairIn], Field(min_length=1, max_length=MOST_PROFILES)] = Field(
        description="The ends of each line."
    )
    wavelength_m: Positive | None = Field(None, description="Asks for the first Fresnel zone, metres.")
    radio: RadioIn | None = Field(
        None, description="Asks for the signal from end to end; its Fresnel zone comes without wavelength_m too."
    )
    unknown: Literal["unknown", "open", "blocked"] = Field(
        "unknown", description="What a line over unknown ground is, unless known ground blocks it already."
    )
    curvature: CurvatureChoice = Field(
        "auto", description="auto: what the DEM's CRS implies (flat without a CRS); flat: none; or numbers."
    )
    max_places: Annotated[int, Field(strict=True, ge=2, le=MOST_PLACES)] = Field(
        512, description="At most so many places of a profile, a number; of several the one of least clearance stays."
    )


class SignalTold(BaseModel):
    """The signal from one end of a line to the other; null where it is not known, or nothing arrives."""

    free_space_db: float = Field(description="Loss in free space, dB.")
    diffraction_db: float | None = Field(
        description="Loss over ground and roofs, dB; null inside them or over unknown ground."
    )
    canopy_m: float | None = Field(description="Way between crown bases and tops, metres.")
    canopy_db: float | None = Field(description="Loss on it, dB; null outside the range of the canopy's model.")
    received_dbm: float | None = Field(description="Power that arrives, dBm.")
    margin_db: float | None = Field(description="What of it is beyond the receiver's need, dB; usable from 0 on.")
    probability: float | None = Field(description="Probability that enough arrives, 0..1, with the radio's spread.")


class AnchorSeen(BaseModel):
    """One anchor from one place."""

    id: str = Field(description="The anchor's id.")
    verdict: Literal["visible", "hidden", "unknown", "out_of_reach"] = Field(
        description="Whether it is in sight; out_of_reach: its antenna's limits leave the place out."
    )
    clearance_m: float | None = Field(
        description="Least height of the line over known ground, metres; negative: hidden by so much; null: none there."
    )
    distance_m: float | None = Field(description="Straight distance, metres; null where the place is unknown.")
    blocking_point: BlockingPoint | None = Field(description="Where it is hidden most; null unless ground hides it.")
    probability_clear: float | None = Field(
        None, description="Probability that the line is clear, 0..1; null without dem_sigma_m."
    )
    signal: SignalTold | None = Field(None, description="Its signal there; null without a radio.")


class DilutionProbed(BaseModel):
    """Dilutions of precision by the anchors in sight, no unit; null where there is no fix."""

    gdop: float | None = Field(description="Of everything solved for, no unit.")
    pdop: float | None = Field(description="Of the position, no unit.")
    hdop: float | None = Field(description="Of its horizontal part, no unit.")
    vdop: float | None = Field(description="Of its vertical part, no unit.")
    tdop: float | None = Field(description="Of the clock, no unit; 0 where none is solved for.")
    reason: Literal["ok", "too_few", "singular", "unknown"] = Field(description="Why there is no fix, or ok.")


class PlaceProbed(BaseModel):
    """The ground at one place, and what is seen from above it."""

    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    lon_deg: float | None = Field(description="Longitude, degrees; null for a DEM without CRS.")
    lat_deg: float | None = Field(description="Latitude, degrees; null for a DEM without CRS.")
    ground_m: float | None = Field(description="Altitude of the ground, metres; null where it is unknown or no DEM is.")
    slope_deg: float | None = Field(description="How steep the ground is, degrees; null where unknown.")
    downhill_deg: float | None = Field(
        description="Which way it falls, degrees clockwise from grid north; null where level or unknown."
    )
    receiver_altitude_m: float | None = Field(description="Altitude of the receiver, metres; null over unknown ground.")
    anchors: list[AnchorSeen] = Field(description="Every anchor, in the order of the request.")
    visible_anchors: int = Field(description="How many are in sight, or usable where that is asked for.")
    dilution: DilutionProbed | None = Field(description="By the anchors in sight; null without anchors.")
    position_sigma_m: float | None = Field(description="One-sigma error of a fix by them, metres; null without a fix.")
    horizontal_sigma_m: float | None = Field(description="Its horizontal part, metres; null without a fix.")


class ProbeOut(BaseModel):
    """The answer, place by place."""

    points: list[PlaceProbed] = Field(description="The places, in the order of the request.")
    curvature: str = Field(description="Curvature and refraction that were used.")
    warnings: list[str] = Field(description="What to know before trusting it, in sentences.")


class ProfileOut(BaseModel):
    """The ground under one line, as columns of numbers; null where the ground is unknown."""

    verdict: Literal["clear", "blocked", "unknown"] = Field(description="Whether the line is clear of the surface.")
    clearance_m: float | None = Field(description="Least height of the line over known ground, metres.")
    distance_m: list[float] = Field(description="Horizontal distance from the first point, metres, rising.")
    ground_m: list[float | None] = Field(description="Altitude of the ground there, metres.")
    roof_m: list[float | None] | None = Field(
        None, description="Altitude of the roof there, metres; null where nothing stands, all of it without a cover."
    )
    canopy_base_m: list[float | None] | None = Field(
        None, description="Altitude at which crowns begin there, metres, null beside trees; null without a canopy."
    )
    canopy_top_m: list[float | None] | None = Field(None, description="Altitude of the crowns' tops, likewise.")
    line_m: list[float] = Field(description="Altitude of the line there, metres; with curvature it sags.")
    fresnel_radius_m: list[float] | None = Field(
        None, description="Radius of the first Fresnel zone there, metres; null without a wavelength."
    )
    fresnel_clearance: float | None = Field(None, description="Least clearance in radii of that zone, no unit.")
    blocking_point: BlockingPoint | None = Field(description="Where it is blocked most; null unless it is.")
    blocking_distance_m: float | None = Field(description="Horizontal distance to it, metres; null unless blocked.")
    signal: SignalTold | None = Field(None, description="The signal from end to end; null without a radio.")


class ProfilesOut(BaseModel):
    """The answer, line by line."""

    profiles: list[ProfileOut] = Field(description="The lines, in the order of the request.")
    curvature: str = Field(description="Curvature and refraction that were used.")
    warnings: list[str] = Field(description="What to know before trusting it, in sentences.")
