"""What the detector answers: per anchor which witness said what, per epoch which ranges a position may lean on.

Naming a member of an enumeration costs a function call in Python 3.11, and an epoch asks for hundreds: the modules that
judge range by range bind members to names of their own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt

__all__ = [
    "AnchorVerdict",
    "Classification",
    "EpochResult",
    "OdometryCondition",
    "PlanningStatus",
    "PositionFix",
    "RejectedRange",
    "Rejection",
    "Say",
    "SearchReport",
    "Sight",
    "Witness",
    "WitnessSay",
]


class Classification(StrEnum):
    """How many anchors of an epoch are occluded; undetermined = redundancy does not suffice to tell."""

    NONE = "none"
    SINGLE = "single"
    MULTIPLE = "multiple"
    UNDETERMINED = "undetermined"


class Sight(StrEnum):
    """What a range says about its anchor's line of sight; unknown is a third answer.

    Too short is none about sight: no occlusion shortens a range. The anchor stands elsewhere, or the ranging errs.
    """

    CLEAR = "clear"
    OCCLUDED = "occluded"
    TOO_SHORT = "too short"
    UNKNOWN = "unknown"


OCCLUDED, TOO_SHORT = Sight.OCCLUDED, Sight.TOO_SHORT


class Witness(StrEnum):
    """Who speaks about an anchor."""

    GEOMETRY = "geometry"  # do the ranges of this epoch meet in one point
    ODOMETRY = "odometry"  # has the range changed by more than the rover moved
    MOTION = "motion"  # does the range fit where the rover's track leads
    PREDICTION = "prediction"  # does the map expect the anchor in sight


class Say(StrEnum):
    """What a witness says about an anchor."""

    CLEAR = "clear"
    OCCLUDED = "occluded"
    TOO_SHORT = "too short"
    SILENT = "silent"


class Rejection(StrEnum):
    """Why a range or an epoch was not used. The session goes on and counts it."""

    NOT_FINITE = "not finite"
    NOT_POSITIVE = "not positive"
    TOO_LONG = "longer than any range can be"
    UNKNOWN_ANCHOR = "unknown anchor"
    ANCHOR_TWICE = "anchor twice in one epoch"
    BAD_SIGMA = "sigma not a positive number"
    BAD_PRIOR = "probability of sight outside 0 to 1"
    BAD_TIME = "time not finite"
    BAD_GROUND = "height of the ground not finite, without a sigma, or in two dimensions"
    BAD_ODOMETRY = "odometry not finite or without duration"
    DUPLICATE = "duplicate epoch"
    OUT_OF_ORDER = "older than the epoch before it"
    LATE = "older than the window"


class OdometryCondition(StrEnum):
    """What the cross-check of wheels against accelerometer and the speed check found (seed 000, odometry step 3)."""

    MISSING = "missing"
    RELIABLE = "reliable"
    STUCK = "stuck"  # wheels turn, nothing accelerates
    SLIPPED = "slipped"  # the rover moves, its wheels do not
    DIFFERENT = "different"  # both move, by different lengths
    TOO_FAST = "too fast"
    MISLED = "heading contradicts the ranges"  # its length is used, its heading is not


class PlanningStatus(StrEnum):
    """What a path planner may make of this epoch."""

    CHECKED = "checked"  # a position that redundant ranges confirm
    DEGRADED = "degraded"  # a position from the ranges that are left, still confirmed
    UNCHECKED = "unchecked"  # a position that nothing confirms
    NO_POSITION = "no position"


@dataclass(frozen=True, slots=True)
class WitnessSay:
    """What one witness said about one anchor.

    evidence: by how much it found the range off, over what it tolerates (above 1 = beyond); NaN where it has none.
    weight: its share in the verdict before all are normalised, 0 where it does not vote. reason: one sentence.
    probability: that the range is off, as this witness has it; NaN where it is silent.
    """

    witness: Witness
    says: Say
    evidence: float
    weight: float
    reason: str
    probability: float = math.nan


@dataclass(frozen=True, slots=True)
class AnchorVerdict:
    """The verdict on one anchor in one epoch.

    probability: that the range is off, so occluded or too short, 0 to 1. confidence: in ``sight``, 0 to 1. score: what
    ranks ranges from clear to occluded on one scale over a whole session: |excess| over what is harmful; larger = more
    surely off. excess_m: measured minus expected range, by the best witness there is; NaN where nothing is expected.
    """

    anchor_id: str
    sight: Sight
    probability: float
    confidence: float
    score: float
    range_m: float
    excess_m: float
    says: tuple[WitnessSay, ...]
    reason: str

    @property
    def occluded(self) -> bool:
        """The binary flag: neither unknown nor too short is occluded."""
        return self.sight is OCCLUDED

    @property
    def off(self) -> bool:
        """Whether a position should do without the range: it is occluded, or too short."""
        return self.sight is OCCLUDED or self.sight is TOO_SHORT


@dataclass(frozen=True, slots=True, eq=False)
class PositionFix:
    """A position with its covariance, metres and m²: (3,) and (3, 3) east, north, up, or (2,) and (2, 2) in 2D.

    mirror_m: the other solution where the anchors lie in one plane (or on one line in 2D) and no hint settles which is
    the rover's; None = only one. checked: whether more ranges than unknowns confirm it.
    """

    position_m: npt.NDArray[np.float64]
    covariance_m2: npt.NDArray[np.float64]
    checked: bool
    mirror_m: npt.NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True)
class SearchReport:
    """How the sets of ranges were searched: so many were tried, of all that are as large as the answer or larger.

    complete: all that could matter were; those that two or three of their ranges rule out need no fit.
    """

    tried: int
    complete: bool
    sets: int


@dataclass(frozen=True, slots=True)
class RejectedRange:
    """A range, or odometry or ground (anchor_id ""), that was not used, and why."""

    anchor_id: str
    reason: Rejection


@dataclass(frozen=True, slots=True)
class EpochResult:
    """The answer to one epoch. time_s: of the epoch, on the base station's clock.

    rejection: why the epoch as a whole was not used; None = it was. Then there are no verdicts.
    verdicts: one per range used, in the epoch's order. excluded, included: their ids, for the multilateration.
    position: of this epoch; None where the ranges left allow none. needed: what would settle what stays open, or "".
    summary: one sentence.
    """

    time_s: float
    rejection: Rejection | None
    classification: Classification
    verdicts: tuple[AnchorVerdict, ...]
    excluded: tuple[str, ...]
    included: tuple[str, ...]
    position: PositionFix | None
    planning: PlanningStatus
    odometry: OdometryCondition
    search: SearchReport
    rejected: tuple[RejectedRange, ...]
    needed: str
    summary: str
