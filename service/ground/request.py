"""A DEM that is asked for by its area."""

from __future__ import annotations

from typing import Annotated

from pydantic import ConfigDict, Field

from service.parts.area import AreaChoice, area_of
from service.parts.points import NotNegativeMetres, Positive, StrictModel
from terrain import GRID_METRES, Area

__all__ = ["GroundIn"]


class GroundIn(StrictModel):
    """An area whose ground is made from the library: the finest tiles first, on one grid in one metric CRS."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"area": {"lon_deg": -84.23, "lat_deg": 36.2, "radius_m": 5000.0}, "margin_m": 2000.0},
                {"area": {"west_deg": -84.3, "south_deg": 36.2, "east_deg": -84.2, "north_deg": 36.3}, "cell_m": 30.0},
            ]
        }
    )

    area: AreaChoice = Field(description="Which ground: a box, a circle round a place, a polygon or GeoJSON.")
    margin_m: NotNegativeMetres = Field(
        0.0, description="Ground around the area that is read too, because it hides: up to the anchors' range, metres."
    )
    crs: Annotated[str, Field(max_length=4000)] | None = Field(
        None,
        description="Metric CRS of the grid and of an area in metres; left out = the finest tiles' or a local.",
    )
    cell_m: Positive | None = Field(None, description="Metres between posts; left out = the finest tiles'.")
    body: Annotated[str, Field(max_length=80)] = Field("Earth", description="Body whose ground it is.")

    def area_asked(self) -> Area:
        """The area, its metres in ``crs``. Raises AreaError, RequestError."""
        return area_of(self.area, self.crs or GRID_METRES)
