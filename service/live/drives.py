"""The path of a session and what lies ahead on it, as requests and answers write them."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from planning.watching import Advice, Drive, MoveAdvice, PathAdvice
from service.parts.points import Metres, Positive, StrictModel

__all__ = ["AdviceOut", "DriveIn", "FullAdviceOut", "advice_answer", "move_answer", "path_answer"]

MOST_PLACES = 10_000


class DriveIn(StrictModel):
    """The path that the rover is to follow, and what it needs on it."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"path_m": [[100.0, 100.0], [180.0, 140.0]], "speed_m_per_s": 0.5}]}
    )

    path_m: Annotated[list[tuple[Metres, Metres]], Field(min_length=2, max_length=MOST_PLACES)] = Field(
        description="Places (east, north) in the DEM's CRS, metres, in the order of the way."
    )
    speed_m_per_s: Positive = Field(1.0, description="The speed that is foreseen.")
    max_speed_m_per_s: Positive = Field(2.0, description="The speed that is possible.")
    min_anchors: Annotated[int, Field(strict=True, ge=1, le=62)] = Field(
        4, description="A stretch with fewer usable anchors is told."
    )
    horizon_m: Positive = Field(500.0, description="How far ahead is looked, metres along the path.")
    interval_s: Annotated[float, Field(strict=True, ge=0.01, le=3600.0)] = Field(
        1.0, description="Seconds between two epochs of ranges."
    )
    max_slope_deg: Annotated[float, Field(strict=True, gt=0.0, le=90.0)] = Field(
        25.0, description="Of ground that the rover can drive over, degrees; for another path."
    )
    movable: list[str] | None = Field(
        None, max_length=62, description="Ids of the anchors that are drones and may be moved; null = none."
    )

    def drive(self) -> Drive:
        """The same for the map. Raises WatchError."""
        given = self.model_dump(exclude={"movable", "max_slope_deg"})
        return Drive(**given, max_slope_rad=math.radians(self.max_slope_deg))


class Exact(BaseModel):
    """What is answered is exactly what is documented."""

    model_config = ConfigDict(extra="forbid")


class DarkStretchOut(Exact):
    """A stretch with too few usable anchors."""

    from_m: float = Field(description="Where it begins, metres along the path.")
    to_m: float = Field(description="Where it ends, metres along the path.")
    in_s: float = Field(description="Seconds until it begins, at the foreseen speed.")
    for_s: float = Field(description="Seconds that it takes, at the foreseen speed.")
    fewest: int = Field(description="How few anchors are usable where there are fewest.")
    hidden: list[str] = Field(description="Anchors that are not usable somewhere in it.")
    bubble_m: float = Field(description="Radius of the largest safety bubble in it, metres.")


class SpeedOut(Exact):
    """Another speed that makes the bubble smaller."""

    speed_m_per_s: float = Field(description="The speed.")
    bubble_m: float = Field(description="The largest bubble ahead at that speed, metres.")
    bubble_before_m: float = Field(description="The same at the foreseen speed.")
    sentence: str = Field(description="What to do.")


class ObstructedOut(Exact):
    """Where the path leads through what no rover is on."""

    from_m: float = Field(description="Where it begins, metres along the path.")
    to_m: float = Field(description="Where it ends, metres along the path.")
    what: Literal["building", "unknown ground", "outside the map"] = Field(description="What is there.")


class AdviceOut(Exact):
    """What lies ahead on the path."""

    at_m: float = Field(description="Where the rover is, metres along the path.")
    off_path_m: float = Field(description="How far beside the path it is, metres.")
    along_m: list[float] = Field(description="Metres along the path, of the next two.")
    usable: list[int] = Field(description="How many anchors will be usable there.")
    bubble_m: list[float] = Field(description="Radius of the safety bubble there, metres.")
    stretches: list[DarkStretchOut] = Field(
        description="Where too few anchors will be usable, in the order of the way."
    )
    speed: SpeedOut | None = Field(description="A better speed; null: none is clearly better.")
    obstructed: list[ObstructedOut] = Field(
        description="Where the path leads through a building, over unknown ground or off the DEM, in its order."
    )


class AdvisedMoveOut(Exact):
    """A drone to move before the first stretch."""

    anchor_id: str | None = Field(description="Which drone; null: no move helps.")
    east_m: float | None = Field(description="Where to, metres.")
    north_m: float | None = Field(description="Where to, metres.")
    altitude_m: float | None = Field(description="How high, metres.")
    flight_m: float | None = Field(description="Length of its flight, metres.")
    flight_s: float | None = Field(description="How long it flies, seconds.")
    restored: bool = Field(description="Whether the whole stretch sees enough anchors then.")
    sentence: str = Field(description="The same in words.")


class AdvisedPathOut(Exact):
    """A way round the first stretch."""

    path_m: list[tuple[float, float]] | None = Field(description="Places (east, north), metres; null: there is none.")
    from_m: float = Field(description="Where it leaves the path, metres along it.")
    to_m: float = Field(description="Where it comes back, metres along the path.")
    longer_m: float | None = Field(description="By so much longer than the path, metres.")
    fewest: int | None = Field(description="How few anchors are in sight where there are fewest.")
    sentence: str = Field(description="The same in words, or why there is none.")


class FullAdviceOut(AdviceOut):
    """The same with a move and a way round."""

    path: AdvisedPathOut | None = Field(description="A way round the first stretch; null: no stretch.")

    move: AdvisedMoveOut | None = Field(
        description="For the first stretch, where drones may be moved; null: nothing to move."
    )


def advice_answer(advice: Advice) -> dict[str, object]:
    """In the words of ``AdviceOut``."""
    speed = advice.speed
    return {
        "at_m": advice.at_m,
        "off_path_m": advice.off_path_m,
        "along_m": advice.along_m.tolist(),
        "usable": advice.usable.tolist(),
        "bubble_m": advice.bubble_m.tolist(),
        "stretches": [
            {
                "from_m": one.from_m,
                "to_m": one.to_m,
                "in_s": one.in_s,
                "for_s": one.for_s,
                "fewest": one.fewest,
                "hidden": one.hidden,
                "bubble_m": one.bubble_m,
            }
            for one in advice.stretches
        ],
        "speed": None
        if speed is None
        else {
            "speed_m_per_s": speed.speed_m_per_s,
            "bubble_m": speed.bubble_m,
            "bubble_before_m": speed.bubble_before_m,
            "sentence": speed.sentence,
        },
        "obstructed": [{"from_m": one.from_m, "to_m": one.to_m, "what": str(one.what)} for one in advice.obstructed],
    }


def path_answer(advised: PathAdvice) -> dict[str, object]:
    """In the words of ``AdvisedPathOut``."""
    return {
        "path_m": None if advised.path_m is None else advised.path_m.tolist(),
        "from_m": advised.from_m,
        "to_m": advised.to_m,
        "longer_m": advised.longer_m,
        "fewest": advised.fewest,
        "sentence": advised.sentence,
    }


def move_answer(advised: MoveAdvice) -> dict[str, object]:
    """In the words of ``AdvisedMoveOut``."""
    move, found = advised.found.move, advised.found
    return {
        "anchor_id": None if move is None else move.anchor.id,
        "east_m": None if move is None else move.to.east_m,
        "north_m": None if move is None else move.to.north_m,
        "altitude_m": None if move is None else move.to.altitude_m,
        "flight_m": None if move is None else move.flight_m,
        "flight_s": None if move is None else move.flight_s,
        "restored": found.restored,
        "sentence": advised.sentence,
    }
