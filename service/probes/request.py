"""What is asked about single places and lines, answered at once."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, JsonValue, model_validator

from service.parts.map_answers import DEM_ID, DemId
from service.parts.points import Metres, NotNegativeMetres, Positive, StrictModel
from service.parts.shapes import PlaceIn
from service.parts.sight import CurvatureChoice, SightParameters
from service.products.lines_of_sight.request import FROM, TO, PairIn

__all__ = ["MOST_PLACES", "MOST_POINTS", "MOST_PROFILES", "ProbeIn", "ProfilesIn"]

MOST_POINTS, MOST_PROFILES, MOST_PLACES = 100, 64, 4096
ANCHORS: list[JsonValue] = [{"id": "D1", "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 120.0}]
POINTS: list[JsonValue] = [{"east_m": 398100.0, "north_m": 3791700.0}]


class ProbeIn(SightParameters):
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


class ProfilesIn(StrictModel):
    """Pairs of points on a DEM; what lies under and around the straight line between them is wanted."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"dem_id": DEM_ID, "pairs": [{"from": FROM, "to": TO}], "wavelength_m": 0.125}]}
    )

    dem_id: DemId
    pairs: Annotated[list[PairIn], Field(min_length=1, max_length=MOST_PROFILES)] = Field(
        description="The ends of each line."
    )
    wavelength_m: Positive | None = Field(None, description="Asks for the first Fresnel zone, metres.")
    unknown: Literal["unknown", "open", "blocked"] = Field(
        "unknown", description="What a line over unknown ground is, unless known ground blocks it already."
    )
    curvature: CurvatureChoice = Field(
        "auto", description="auto: what the DEM's CRS implies (flat without a CRS); flat: none; or numbers."
    )
    max_places: Annotated[int, Field(strict=True, ge=2, le=MOST_PLACES)] = Field(
        512, description="At most so many places of a profile, a number; of several the one of least clearance stays."
    )
