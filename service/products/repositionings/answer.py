"""Repositionings as the service tells about them."""

from __future__ import annotations

from typing import Any, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from service.parts.anchors import AnchorId
from service.parts.map_answers import DEM_ID, DemId, MapOut, MapSummary, running_example
from service.parts.older_results import OrOlder
from service.parts.pages import Page
from service.parts.points import NotNegative
from service.products.repositionings.request import RepositioningParameters

__all__ = ["RepositioningIn", "RepositioningList", "RepositioningOut", "RepositioningSummary"]

REQUEST: dict[str, Any] = {
    "dem_id": DEM_ID,
    "anchors": [
        {"id": "D1", "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 80.0},
        {"id": "D2", "east_m": 398100.0, "north_m": 3791700.0, "above_ground_m": 80.0},
        {"id": "D3", "east_m": 400700.0, "north_m": 3790100.0, "above_ground_m": 80.0},
        {"id": "D4", "east_m": 399500.0, "north_m": 3793400.0, "above_ground_m": 80.0},
    ],
    "occluded": ["D2"],
    "rover": {"place": {"east_m": 400100.0, "north_m": 3792900.0}, "heading_deg": 60.0, "ahead_m": 400.0},
    "goal": {"objective": "coverage", "visible": 4},
    "flight": {"max_flight_m": 3000.0},
}


class RepositioningIn(RepositioningParameters):
    """A DEM, anchors, which are occluded, and the way ahead."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId
    detector_id: AnchorId | None = Field(
        None, description="A detector session: anchors that it finds occluded for persistent_s join ``occluded``."
    )
    persistent_s: NotNegative = Field(
        10.0, description="How long every range of an anchor must have been occluded, seconds."
    )

    @model_validator(mode="after")
    def _known_ids(self) -> Self:
        ids = {anchor.id for anchor in self.anchors}
        for name, given in (("occluded", self.occluded), ("movable", self.movable or [])):
            strange = next((one for one in given if one not in ids), None)
            if strange is not None:
                raise ValueError(f"{name}: there is no anchor {strange!r} among the anchors.")
        return self


class StandingOut(BaseModel):
    """Where an anchor stands."""

    id: str = Field(description="Name of the anchor.")
    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Height in the DEM's vertical datum, metres.")
    above_ground_m: float | None = Field(description="Height above known ground, metres.")


class MoveOut(BaseModel):
    """One drone's move."""

    model_config = ConfigDict(populate_by_name=True)

    anchor_id: str = Field(description="Which drone.")
    from_: StandingOut = Field(alias="from", description="Where it stood.")
    to: StandingOut = Field(description="Where it goes.")
    flight_m: float = Field(description="Metres of its flight: up, level, down.")
    flight_s: float = Field(description="Seconds that it takes.")
    start_s: float = Field(description="When it leaves, seconds since the rover's start.")
    end_s: float = Field(description="When it has arrived, seconds since the rover's start.")
    stretch: int = Field(description="Number of the stretch that it is for.")


class StretchOut(BaseModel):
    """A stretch of the path."""

    from_m: float = Field(description="Where it begins, metres along the path.")
    to_m: float = Field(description="Where it ends, metres along the path.")
    depart_s: float = Field(description="When the rover leaves its beginning, seconds since the start.")
    arrive_s: float = Field(description="When it reaches its end, seconds since the start.")
    waited_s: float = Field(description="How long it waits for drones before, seconds.")
    before_share: float = Field(description="Part of it that is good when nobody moves, 0..1.")
    after_share: float = Field(description="Part of it that is good with the moves, 0..1.")


class RepositioningSummary(MapSummary):
    """Who moves where, and what it brings."""

    goal: str = Field(description="What shall hold, in words.")
    occluded: list[str] = Field(description="Anchors that were taken as hidden for good.")
    before_share: float = Field(description="Part of the path where it holds when nobody moves, 0..1.")
    after_share: float = Field(description="Part of the path where it holds with the moves, 0..1.")
    restored: bool = Field(description="Whether the share asked for is reached, on every stretch.")
    sentence: str = Field(description="The answer in words.")
    moves: list[MoveOut]
    anchors: list[StandingOut] = Field(description="All anchors after the last move.")
    stretches: list[StretchOut]
    flight_m: float = Field(description="Metres that all drones fly.")
    waited_s: float = Field(description="Seconds that the rover waits for them.")


class RepositioningOut(MapOut):
    """A repositioning: how its calculation stands, and its result when it has one."""

    model_config = ConfigDict(json_schema_extra={"examples": [running_example("/repositionings", REQUEST)]})

    result: OrOlder[RepositioningSummary] = Field(description="Who moves where; null until it succeeded.")


class RepositioningList(Page):
    """One page of repositionings, newest first."""

    repositionings: list[RepositioningOut]
