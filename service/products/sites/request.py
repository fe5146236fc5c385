"""What a map of sites is asked for: how high sites and receivers are, what shall be seen, how many sites to name."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import ConfigDict, Field, JsonValue, model_validator

from service.parts.anchors import CurvatureChoice
from service.parts.areas import AreaChoice
from service.parts.map_area import AreaParameters
from service.parts.map_facts import DEM_ID, DemId
from service.parts.points import NotNegativeMetres, Positive
from service.parts.radios import SightChoice
from visibility.sites import DIRECTIONS, LEAST_DIRECTIONS, MOST_DIRECTIONS

__all__ = ["REQUEST", "SiteMapIn", "SiteMapParameters"]

MOST_SITES = 1000
REQUEST: dict[str, JsonValue] = {
    "dem_id": DEM_ID,
    "site_above_ground_m": 20.0,
    "receiver_above_ground_m": 1.5,
    "max_range_m": 8000.0,
    "sites": 12,
    "min_separation_m": 1500.0,
}


class SiteMapParameters(AreaParameters, SightChoice):
    """Heights of sites and receivers, what shall be seen, how many sites to name."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{name: value for name, value in REQUEST.items() if name != "dem_id"}]}
    )
    sight_alone = "a map of sites has no anchors whose radios it could know."

    site_above_ground_m: NotNegativeMetres = Field(
        10.0, description="Height of a site's antenna above the ground of each post, metres."
    )
    receiver_above_ground_m: NotNegativeMetres = Field(
        1.5, description="Height of the receiver's antenna above the ground that it stands on, metres."
    )
    target_area: AreaChoice | None = Field(
        None, description="The ground that shall be seen; left out = all of the DEM."
    )
    max_range_m: Positive | None = Field(None, description="Longest range, metres; left out = unlimited.")
    directions: Annotated[int, Field(strict=True, ge=LEAST_DIRECTIONS, le=MOST_DIRECTIONS, multiple_of=4)] = Field(
        DIRECTIONS, description="How many rays go out from each post, a multiple of four: more are finer and slower."
    )
    sites: Annotated[int, Field(strict=True, ge=0, le=MOST_SITES)] = Field(
        10, description="How many of the best sites to name, a number; those of the area, where one is given."
    )
    min_separation_m: NotNegativeMetres | None = Field(
        None, description="Named sites are so far apart, metres; left out = a tenth of the shorter side of the ground."
    )
    curvature: CurvatureChoice = Field(
        "auto", description="auto: what the DEM's CRS implies (flat without a CRS); flat: none; or numbers."
    )

    @model_validator(mode="after")
    def _on_bare_ground(self) -> Self:
        if self.cover is not None:
            raise ValueError("A map of sites knows bare ground only; leave out cover, or ask for a visibility map.")
        return self


class SiteMapIn(SiteMapParameters):
    """The same on a DEM."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId
