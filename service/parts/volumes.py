"""A control volume and cuts through it, as requests write them."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from service.parts.points import Metres, NotNegativeMetres, Positive, StrictModel
from service.parts.shapes import PlaceIn

__all__ = ["MOST_CUTS", "BoundsIn", "CutIn", "VolumeIn"]

MOST_CUTS = 8


class BoundsIn(StrictModel):
    """A rectangle in the DEM's metric CRS; the posts within it count."""

    west_m: Metres = Field(description="Its least east, metres.")
    south_m: Metres = Field(description="Its least north, metres.")
    east_m: Metres = Field(description="Its largest east, metres.")
    north_m: Metres = Field(description="Its largest north, metres.")


class VolumeIn(StrictModel):
    """The air between a floor and a ceiling, in layers of voxels over the posts of the DEM."""

    ceiling_altitude_m: Metres | None = Field(
        None, description="Top, metres in the DEM's vertical datum: layers are altitudes. Or ceiling_above_ground_m."
    )
    ceiling_above_ground_m: Positive | None = Field(
        None, description="Top above the ground of each post, metres: layers follow the ground."
    )
    floor_m: Metres | None = Field(
        None, description="Lowest layer, metres, counted as the ceiling is; left out = the lowest ground."
    )
    layer_m: Positive | None = Field(
        None, description="From layer to layer, metres; left out = the DEM's smaller cell, and at most 100 layers."
    )
    bounds_m: BoundsIn | None = Field(None, description="Only here; left out = the whole DEM.")

    @model_validator(mode="after")
    def _one_ceiling(self) -> Self:
        if (self.ceiling_altitude_m is None) == (self.ceiling_above_ground_m is None):
            given = "neither was" if self.ceiling_altitude_m is None else "both were"
            raise ValueError(
                f"The volume needs exactly one of ceiling_altitude_m and ceiling_above_ground_m; {given} given."
            )
        return self


class CutIn(StrictModel):
    """A cut: vertical along a line on the map, or horizontal at an altitude or a height above ground."""

    line: Annotated[list[PlaceIn], Field(min_length=2, max_length=1000)] | None = Field(
        None, description="Corners of the line that a vertical cut follows, at least two entries."
    )
    altitude_m: Metres | None = Field(
        None, description="Height of a horizontal cut, metres in the DEM's vertical datum."
    )
    above_ground_m: NotNegativeMetres | None = Field(
        None, description="Height of a cut that follows the ground, metres above it."
    )

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        given = sum(value is not None for value in (self.line, self.altitude_m, self.above_ground_m))
        if given != 1:
            raise ValueError(f"A cut needs exactly one of line, altitude_m and above_ground_m; {given} were given.")
        return self
