"""What maps of positioning are asked for: anchors and satellites, the dilution of precision and its limit."""

from __future__ import annotations

from datetime import date
from typing import Annotated, Literal, Self

from pydantic import AwareDatetime, Field, model_validator

from .points import DegreesEast, DegreesNorth, Metres, NotNegativeMetres, StrictModel
from .sight import SightParameters

__all__ = ["DopMapParameters", "MorphingMapParameters", "PositioningParameters", "SatellitesIn"]

Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0)]
# A YUMA almanac of 63 satellites takes 40 kB.
ALMANAC_CHARACTERS = 200_000


class SatellitesIn(StrictModel):
    """GPS satellites at one time, from the text of an almanac."""

    almanac: str = Field(min_length=1, max_length=ALMANAC_CHARACTERS, description="Text of a SEM or YUMA almanac file.")
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
    def _whole_place(self) -> Self:
        if (self.lon_deg is None) != (self.lat_deg is None):
            raise ValueError("Give both of lon_deg and lat_deg of the satellites' place, or neither.")
        return self


class PositioningParameters(SightParameters):
    """Anchors, satellites, and how good positioning must be."""

    satellites: SatellitesIn | None = Field(None, description="GPS satellites, besides the anchors or in their place.")
    kind: Literal["ranging", "pseudorange", "tdoa"] = Field(
        "ranging", description="What is measured: ranges; ranges with an unknown clock; differences of arrival."
    )
    measure: Literal["gdop", "pdop", "hdop", "vdop"] = Field("pdop", description="Which dilution of precision.")
    dop_limit: Positive = Field(2.5, description="From this dilution on positioning is not good enough, no unit.")
    min_anchors: Annotated[int, Field(strict=True, ge=1)] | None = Field(
        None, description="So many anchors must be in sight as well; left out = as many as a fix needs."
    )

    @model_validator(mode="after")
    def _something_to_range_to(self) -> Self:
        if not self.anchors and self.satellites is None:
            raise ValueError("Give anchors or satellites; there is nothing to range to.")
        return self


class DopMapParameters(PositioningParameters):
    """How good positioning is for a rover on the ground, over a whole DEM."""

    receiver_above_ground_m: NotNegativeMetres = Field(
        1.5, description="Height of the rover's antenna above the ground of each post, metres."
    )
    on_surface: bool = Field(
        False, strict=True, description="The rover is on the ground, so only its motion along the surface is unknown."
    )


class MorphingMapParameters(PositioningParameters):
    """Above which altitude positioning is good enough, up to a ceiling."""

    ceiling_altitude_m: Metres | None = Field(
        None, description="Top of the air, metres in the DEM's vertical datum; or give ceiling_above_ground_m."
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
