"""GPS satellites, as requests bring them along: the text of their orbits, and when."""

from __future__ import annotations

from datetime import date
from typing import Annotated, Self

from pydantic import AwareDatetime, Field, model_validator

from service.parts.points import DegreesEast, DegreesNorth, NotNegativeMetres, StrictModel

__all__ = ["ORBIT_TEXTS", "SatellitesIn"]

# A YUMA almanac of 63 satellites takes 40 kB, the GPS navigation file of a day 300 kB.
ALMANAC_CHARACTERS, NAVIGATION_CHARACTERS = 200_000, 1_000_000
# fields that answers leave out: long, and nobody reads them there
ORBIT_TEXTS = frozenset({"almanac", "navigation"})


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
