"""What a DOP map is asked for: anchors and satellites, the antenna's height, a trajectory, a volume and its cuts."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import ConfigDict, Field, JsonValue, model_validator

from service.parts.map_facts import DemId
from service.parts.points import InADatum, Metres, NotNegativeMetres, PlaceIn, PointIn, Positive, StrictModel
from service.parts.positioning import POSITIONING_EXAMPLE, PositioningParameters

__all__ = ["MOST_CUTS", "REQUEST", "BoundsIn", "CutIn", "DopMapIn", "DopMapParameters", "VolumeIn"]

MOST_CUTS = 8
# of a trajectory; more do not fit into a request's body anyway
MOST_PATH_POINTS = 20_000
REQUEST: dict[str, JsonValue] = {
    **POSITIONING_EXAMPLE,
    "dop_limit": 2.5,
    "receiver_above_ground_m": 1.5,
    "on_surface": True,
}


class BoundsIn(StrictModel):
    """A rectangle in the DEM's metric CRS; the posts within it count."""

    west_m: Metres = Field(description="Its least east, metres.")
    south_m: Metres = Field(description="Its least north, metres.")
    east_m: Metres = Field(description="Its largest east, metres.")
    north_m: Metres = Field(description="Its largest north, metres.")


class VolumeIn(InADatum):
    """The air between a floor and a ceiling, in layers of voxels over the posts of the DEM."""

    altitude_fields = ("ceiling_altitude_m",)

    ceiling_altitude_m: Metres | None = Field(
        None, description="Top, metres above altitude_datum: layers are altitudes. Or ceiling_above_ground_m."
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

    def altitudes(self) -> tuple[str, ...]:
        """The ceiling and the floor, which counts as it does."""
        ceiling = super().altitudes()
        return (*ceiling, "floor_m") if ceiling and self.floor_m is not None else ceiling


class CutIn(InADatum):
    """A cut: vertical along a line on the map, or horizontal at an altitude or a height above ground."""

    line: Annotated[list[PlaceIn], Field(min_length=2, max_length=1000)] | None = Field(
        None, description="Corners of the line that a vertical cut follows, at least two entries."
    )
    altitude_m: Metres | None = Field(None, description="Height of a horizontal cut, metres above altitude_datum.")
    above_ground_m: NotNegativeMetres | None = Field(
        None, description="Height of a cut that follows the ground, metres above it."
    )

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        given = sum(value is not None for value in (self.line, self.altitude_m, self.above_ground_m))
        if given != 1:
            raise ValueError(f"A cut needs exactly one of line, altitude_m and above_ground_m; {given} were given.")
        return self


class DopMapParameters(PositioningParameters):
    """How good positioning is for a rover on the ground, over a whole DEM."""

    receiver_above_ground_m: NotNegativeMetres = Field(
        1.5, description="Height of the rover's antenna above the ground of each post, metres."
    )
    on_surface: bool = Field(
        False, strict=True, description="The rover is on the ground, so only its motion along the surface is unknown."
    )
    one_dop_per_set: bool = Field(
        False,
        strict=True,
        description="Calculate one dilution for each visible set, in the middle of the posts that share it, as De Vivo "
        "et al. do: right for satellites, rough for drones nearby. Not together with on_surface.",
    )
    path: list[PointIn] = Field(
        [],
        max_length=MOST_PATH_POINTS,
        description="Points of a trajectory over the DEM; who is in sight and how good positioning is at each is told "
        "in path.csv.",
    )
    volume: VolumeIn | None = Field(
        None, description="Air of which volume.npz, volume.nc and the volume's GeoTIFFs tell every voxel."
    )
    cuts: Annotated[list[CutIn], Field(max_length=MOST_CUTS)] = Field(
        [],
        description="Cuts through the volume, each a picture; left out, the volume goes from the lowest ground to a "
        "little above the highest.",
    )

    @model_validator(mode="after")
    def _no_slope_of_a_set(self) -> Self:
        if self.on_surface and self.one_dop_per_set:
            raise ValueError("A visible set has no one slope; give only one of one_dop_per_set and on_surface.")
        return self

    @model_validator(mode="after")
    def _no_slope_in_the_air(self) -> Self:
        if self.on_surface and (self.volume is not None or self.cuts):
            raise ValueError("Air has no slope; leave out on_surface, or the volume and its cuts.")
        return self


class DopMapIn(DopMapParameters):
    """A DEM, anchors or satellites, and how good positioning must be for a rover on the ground."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId
