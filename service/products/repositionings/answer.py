"""Repositionings as the service tells about them."""

from __future__ import annotations

from pydantic import AliasChoices, BaseModel, ConfigDict, Field

from service.parts.map_facts import MapSummary
from service.parts.positioning_answers import PlacedAnchor

__all__ = ["MoveOut", "RepositioningSummary", "StretchOut"]


class MoveOut(BaseModel):
    """One drone's move."""

    model_config = ConfigDict(serialize_by_alias=True)

    anchor_id: str = Field(description="Which drone.")
    from_: PlacedAnchor = Field(
        validation_alias=AliasChoices("from", "from_"), serialization_alias="from", description="Where it stood."
    )
    to: PlacedAnchor = Field(description="Where it goes.")
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
    anchors: list[PlacedAnchor] = Field(description="All anchors after the last move.")
    stretches: list[StretchOut]
    flight_m: float = Field(description="Metres that all drones fly.")
    waited_s: float = Field(description="Seconds that the rover waits for them.")
