"""A DEM that is asked for by its area."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import ConfigDict, Field, model_validator

from service.parts.areas import AreaChoice, area_of
from service.parts.points import NotNegativeMetres, Positive, StrictModel
from terrain import GRID_METRES, Area

__all__ = ["GroundIn"]

OF_AN_AREA = ("margin_m", "crs", "cell_m", "source", "body")


class GroundIn(StrictModel):
    """An area whose ground is made from the library, the finest tiles first, on one grid in one metric CRS; or one tile
    of any size.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"area": {"lon_deg": -84.23, "lat_deg": 36.2, "radius_m": 5000.0}, "margin_m": 2000.0},
                {"area": {"west_deg": -84.3, "south_deg": 36.2, "east_deg": -84.2, "north_deg": 36.3}, "cell_m": 30.0},
                {"tile": "valley-1m.tif"},
            ]
        }
    )

    area: AreaChoice | None = Field(
        None, description="Which ground: a box, a circle round a place, a polygon or GeoJSON; or give a tile."
    )
    tile: Annotated[str, Field(min_length=1, max_length=255)] | None = Field(
        None,
        description="A GeoTIFF of the library by its name (GET /ground), of any size: the DEM is an overview of all of "
        "it, and window maps read its posts by windows.",
    )
    margin_m: NotNegativeMetres = Field(
        0.0, description="Ground around the area that is read too, because it hides: up to the anchors' range, metres."
    )
    crs: Annotated[str, Field(max_length=4000)] | None = Field(
        None,
        description="Metric CRS of the grid and of an area in metres; left out = the finest tiles' or a local.",
    )
    cell_m: Positive | None = Field(None, description="Metres between posts; left out = the finest tiles'.")
    resolution_m: Positive | None = Field(
        None,
        description="Of files with overviews the coarsest is read whose cells are no coarser than so many metres; left "
        "out = their posts, and of a tile the finest overview that is made at once.",
    )
    source: Annotated[str, Field(min_length=1, max_length=64)] | None = Field(
        None, description="A source that the operator lists (GET /ground names them); left out = the ground library."
    )
    body: Annotated[str, Field(max_length=80)] = Field("Earth", description="Body whose ground it is.")

    @model_validator(mode="after")
    def _area_or_tile(self) -> Self:
        if (self.area is None) == (self.tile is None):
            raise ValueError("Give exactly one of area and tile.")
        odd = [name for name in OF_AN_AREA if name in self.model_fields_set]
        if self.tile is not None and odd:
            raise ValueError(f"{odd[0]} goes with an area; a tile is read as it is.")
        if self.source is not None and self.resolution_m is not None:
            raise ValueError("resolution_m is for the ground library; leave it out, or give cell_m.")
        return self

    def area_asked(self) -> Area:
        """The area, its metres in ``crs``. Raises AreaError, RequestError."""
        assert self.area is not None, "a tile is not asked for by its area"
        return area_of(self.area, self.crs or GRID_METRES)
