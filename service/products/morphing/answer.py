"""Morphing maps as the service tells about them."""

from __future__ import annotations

from pydantic import BaseModel, Field

from service.parts.positioning_answers import PositioningSummary

__all__ = ["FrameFacts", "MorphingMapSummary", "StateShare", "TimeFacts"]


class StateShare(BaseModel):
    """How many columns of air are in a state."""

    state: str = Field(description="nowhere, everywhere, above, closed_at_ceiling, outside or unknown.")
    posts: int = Field(description="Posts with such air.")
    share: float | None = Field(description="The same as part of all posts, 0..1.")


class FrameFacts(BaseModel):
    """One frame of a morphing map over time."""

    time_s: float = Field(description="When, seconds on the clock of the frames.")
    time: str | None = Field(description="The same as an instant, where satellites give it.")
    anchors: int = Field(description="Number of anchors then.")
    satellites: int = Field(description="Number of satellites in view then.")
    surfaces_computed: int = Field(
        description="Number of anchors and satellites that had moved, so that their sight lines were calculated anew."
    )
    share_flyable: float | None = Field(description="Part of the known posts flyable up to the ceiling, 0..1.")


class TimeFacts(BaseModel):
    """What a morphing map says about time."""

    frames: list[FrameFacts]
    available_at: dict[str, float] = Field(
        description="Height of which availability is told: altitude_m or above_ground_m, metres."
    )
    share_always_available: float | None = Field(
        description="Part of the known posts in flyable air at that height in all frames, 0..1."
    )
    share_sometimes_available: float | None = Field(description="The same in some frames, 0..1.")
    share_never_available: float | None = Field(description="The same in none, 0..1.")


class MorphingMapSummary(PositioningSummary):
    """What a morphing map says in numbers, and how far to trust it."""

    ceiling: dict[str, float | None] = Field(description="Top of the air: altitude_m or above_ground_m, metres.")
    states: list[StateShare]
    receiver_above_ground_m: float = Field(1.5, description="Height of a ground rover's antenna, metres.")
    posts_no_go_for_the_rover: int = Field(0, description="Posts where that antenna is in no-flight air.")
    posts_with_several_intervals: int = Field(description="Posts with no-flight air in more than one piece.")
    above_ground_m: dict[str, float | None] = Field(
        description="p05, p50 and p95 of the height above ground from which one may fly, metres; null where nobody may."
    )
    over_time: TimeFacts | None = Field(None, description="Frames and availability, where frames were asked for.")
