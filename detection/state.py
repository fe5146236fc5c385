"""What a detector remembers, to be read: counts, the last word on each anchor, and how healthy its witnesses are."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .verdicts import AnchorVerdict, EpochResult, Rejection, Sight

__all__ = ["AnchorRecord", "AnchorState", "DetectorState", "Health"]


@dataclass(frozen=True, slots=True)
class AnchorState:
    """The last word on one anchor. time_s: of its last range, None before the first. occluded_share: of its ranges."""

    anchor_id: str
    sight: Sight
    probability: float
    time_s: float | None
    range_m: float
    ranges: int
    occluded_share: float


@dataclass(slots=True)
class AnchorRecord:
    """What a session notes of one anchor; changed in place, and read as an ``AnchorState``."""

    last: AnchorVerdict | None = None
    time_s: float | None = None
    ranges: int = 0
    occluded_share: float = 0.0

    def note(self, verdict: AnchorVerdict, time_s: float) -> None:
        """Count one range and its verdict."""
        self.occluded_share = (self.occluded_share * self.ranges + verdict.occluded) / (self.ranges + 1)
        self.last, self.time_s = verdict, time_s
        self.ranges += 1

    def state(self, anchor_id: str) -> AnchorState:
        """As it is now."""
        sight, probability, range_m = Sight.UNKNOWN, 0.5, math.nan
        if self.last is not None:
            sight, probability, range_m = self.last.sight, self.last.probability, self.last.range_m
        return AnchorState(anchor_id, sight, probability, self.time_s, range_m, self.ranges, self.occluded_share)


@dataclass(frozen=True, slots=True)
class Health:
    """How the witnesses have done so far (seed 000, fusion step 5).

    geometry_false_positives, odometry_false_positives: share of ranges that the witness alone flagged and the verdict
        cleared. odometry_failures: share of odometry increments that were not reliable. warnings: sentences.
    """

    geometry_false_positives: float
    odometry_false_positives: float
    odometry_failures: float
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class DetectorState:
    """A snapshot of a detector.

    time_s: of the last epoch, on the ranging clock. epochs: accepted. rejections: how many ranges and epochs were not
    used, by reason. position_m, velocity_m_per_s: of the track, (3,) east, north, up; None without one.
    """

    time_s: float | None
    epochs: int
    rejections: dict[Rejection, int]
    anchors: tuple[AnchorState, ...]
    health: Health
    last: EpochResult | None
    position_m: tuple[float, float, float] | None = None
    velocity_m_per_s: tuple[float, float, float] | None = None
