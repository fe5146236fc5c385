"""What is asked of drones that move for a path ahead, and a drone's move."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from planning.errors import PlacementError
from planning.words import time_words
from visibility import Anchor

from .goals import Goal
from .rules import PlacementRules
from .sight import SightOptions
from .stretches import Flight

__all__ = ["ROUNDING", "USUAL_HEIGHTS_M", "Move", "MoveQuestion", "moved_to"]

ROUNDING = 1e-9
USUAL_HEIGHTS_M = (60.0, 120.0)  # above ground, beside each drone's own altitude, where none are asked for


@dataclass(frozen=True, slots=True)
class MoveQuestion:
    """What moves of drones shall bring, who may move where, and what a flight costs.

    goal: a share, coverage or dop, and share: the part of the path along which it shall hold, 0 < share <= 1.
    occluded: ids that the detector finds hidden for good, whatever the map says: they count only once they are moved, a
        cell at least.
    movable: ids that may be moved; None = all. above_ground_m: the heights to consider, and no others; None =
        USUAL_HEIGHTS_M and each drone's own altitude. every: rows and columns of posts from one place to the next.
    cheapest: whether a flight's metres or its seconds count. sight: its max_range_m is that of the rules.
    Raises PlacementError.
    """

    goal: Goal
    occluded: Collection[str] = ()
    movable: Collection[str] | None = None
    share: float = 1.0
    above_ground_m: Sequence[float] | None = None
    every: int = 1
    receiver_above_ground_m: float = 1.5
    cheapest: Literal["distance", "time"] = "distance"
    flight: Flight = field(default_factory=Flight)
    rules: PlacementRules = field(default_factory=PlacementRules)
    sight: SightOptions = field(default_factory=SightOptions)

    def __post_init__(self) -> None:
        if not self.goal.is_share:
            raise PlacementError("Repositioning restores a share: ask for the objective coverage or dop.")
        if not (math.isfinite(self.share) and 0.0 < self.share <= 1.0):
            raise PlacementError(f"share must be > 0 and <= 1, not {self.share}.")
        if self.above_ground_m is not None and not len(self.above_ground_m):
            raise PlacementError("above_ground_m names no height to move to; give one or leave it out.")
        if self.every < 1:
            raise PlacementError(f"every must be a number of posts >= 1, not {self.every}.")
        # copies: what is asked must not change with a caller's list
        object.__setattr__(self, "occluded", frozenset(self.occluded))
        if self.movable is not None:
            object.__setattr__(self, "movable", frozenset(self.movable))
        object.__setattr__(self, "sight", replace(self.sight, max_range_m=self.rules.max_range_m))

    def check_ids(self, anchors: Sequence[Anchor]) -> None:
        """Raises PlacementError where it names an anchor that is not there."""
        ids = {anchor.id for anchor in anchors}
        strange = sorted({*self.occluded, *(self.movable or ())} - ids)
        if strange:
            raise PlacementError(f"There is no anchor {', '.join(strange[:5])} among {', '.join(sorted(ids)[:10])}.")


@dataclass(frozen=True, slots=True)
class Move:
    """A drone's move. anchor: where it comes from; to: where it goes. flight_m, flight_s: of the path flown."""

    anchor: Anchor
    to: Anchor
    flight_m: float
    flight_s: float

    def words(self) -> str:
        """Who flies how far, how long and where to: the beginning of a sentence."""
        return (
            f"{self.anchor.id} flies {self.flight_m:.0f} m in {time_words(self.flight_s)} to {self.to.east_m:.0f}, "
            f"{self.to.north_m:.0f} at {self.to.altitude_m:.0f} m"
        )


def moved_to(anchor: Anchor, place_m: tuple[float, float, float]) -> Anchor:
    """The anchor at another place (east, north, altitude); of doubts about it those that reach as far go along."""
    east_m, north_m, altitude_m = place_m
    away_m = math.hypot(east_m - anchor.east_m, north_m - anchor.north_m)
    doubts = tuple(doubt for doubt in anchor.doubts if away_m <= doubt.reach_m)
    return replace(anchor, east_m=east_m, north_m=north_m, altitude_m=altitude_m, doubts=doubts)
