"""What a visibility map is asked for, apart from the DEM."""

from __future__ import annotations

from typing import Any, Self

from pydantic import ConfigDict, Field, JsonValue, model_validator

from service.parts.anchors import AnchorIn, SightParameters
from service.parts.doubts import DoubtParameters
from service.parts.map_facts import DEM_ID, DemId
from service.parts.points import InADatum, Metres, NotNegativeMetres

__all__ = ["REQUEST", "VisibilityMapIn", "VisibilityMapParameters"]

DEFAULT_RECEIVER_ABOVE_GROUND_M = 1.5
ANCHORS: list[JsonValue] = [
    {"id": "D1", "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 80.0},
    {"id": "D2", "east_m": 409800.0, "north_m": 3798100.0, "altitude_m": 1612.0},
]
REQUEST: dict[str, JsonValue] = {"dem_id": DEM_ID, "anchors": ANCHORS, "receiver_above_ground_m": 1.5, "mode": "fast"}


class VisibilityMapParameters(SightParameters, DoubtParameters, InADatum):
    """Anchors, receiver height and how to calculate."""

    altitude_fields = ("receiver_altitude_m",)

    model_config = ConfigDict(
        json_schema_extra={"examples": [{name: value for name, value in REQUEST.items() if name != "dem_id"}]}
    )

    anchors: list[AnchorIn] = Field(min_length=1, description="The anchors, at least one, with unique ids.")
    receiver_above_ground_m: NotNegativeMetres | None = Field(
        DEFAULT_RECEIVER_ABOVE_GROUND_M,
        description="Height of the receiver's antenna above the ground of each post, metres; or give "
        "receiver_altitude_m.",
    )
    receiver_altitude_m: Metres | None = Field(
        None, description="One altitude of the receiver over all posts, metres above altitude_datum."
    )

    @model_validator(mode="before")
    @classmethod
    def _altitude_replaces_the_default_height(cls, given: Any) -> Any:
        if isinstance(given, dict) and given.get("receiver_altitude_m") is not None:
            return {"receiver_above_ground_m": None, **given}
        return given

    @model_validator(mode="after")
    def _one_receiver_height(self) -> Self:
        if (self.receiver_above_ground_m is None) == (self.receiver_altitude_m is None):
            given = "neither was" if self.receiver_altitude_m is None else "both were"
            raise ValueError(f"Give exactly one of receiver_above_ground_m and receiver_altitude_m; {given} given.")
        return self


class VisibilityMapIn(VisibilityMapParameters):
    """A DEM, anchors, the receiver's height, and how to calculate."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId
