"""What a map by windows is asked for: what a visibility map is, of anchors that all have a range limit."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import ConfigDict, Field, JsonValue, model_validator

from service.parts.map_facts import DEM_ID, DemId
from service.products.visibility.request import VisibilityMapParameters

__all__ = ["REQUEST", "WindowMapIn", "WindowMapParameters"]

ANCHORS: list[JsonValue] = [
    {"id": "D1", "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 80.0, "max_range_m": 4000.0},
    {"id": "D2", "east_m": 409800.0, "north_m": 3798100.0, "altitude_m": 1612.0, "max_range_m": 2500.0},
]
REQUEST: dict[str, JsonValue] = {"dem_id": DEM_ID, "anchors": ANCHORS, "receiver_above_ground_m": 1.5}


class WindowMapParameters(VisibilityMapParameters):
    """Anchors with range limits, receiver height and how to calculate."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{name: value for name, value in REQUEST.items() if name != "dem_id"}]}
    )

    run_on: Literal["here", "cluster"] = Field(
        "here",
        description="Where sight is worked out: here, in one process; or by the workers of the Dask cluster that is "
        "set up, an anchor each. The answer is the same.",
    )

    @model_validator(mode="after")
    def _on_bare_ground(self) -> Self:
        if self.cover is not None:
            raise ValueError("A map by windows knows bare ground only; leave out cover, or ask for a visibility map.")
        return self


class WindowMapIn(WindowMapParameters):
    """The same on a DEM: one of a tile that is read by windows, or any other."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId
