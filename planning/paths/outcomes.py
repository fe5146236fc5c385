"""The answer: how a plan ended, the path with what holds at each of its vertices, and what stood in the way."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planning.validation import PathValidation

__all__ = [
    "FlightOutcome",
    "Grain",
    "Path",
    "PathOutcome",
    "PathStatus",
    "PathTotals",
    "Reason",
    "Relaxation",
    "Unreachable",
]

Numbers = npt.NDArray[np.float64]


class PathStatus(enum.StrEnum):
    """How a plan ended. FOUND paths have passed the validator; REFUSED: the validator found a fault in each.

    UNREACHABLE: there is no way, which is proved to a grain. UNDECIDED: neither a way nor that proof was found.
    """

    FOUND = "found"
    REFUSED = "refused"
    UNREACHABLE = "unreachable"
    UNDECIDED = "undecided"
    OUT_OF_BUDGET = "out_of_budget"


class Reason(enum.StrEnum):
    """Why a place may not be driven, or in no direction that leads on."""

    SLOPE = "slope"
    PITCH_OR_ROLL = "pitch or roll"
    STEP = "step"
    UNKNOWN_GROUND = "unknown ground"
    NO_GO = "no-go area"
    KEEP_IN = "outside the keep-in areas"
    ANCHORS = "anchors in sight"
    DOP = "dilution"
    MORPHING_MAP = "morphing map"
    BUBBLE = "safety bubble"
    SIGHT_LINE = "exact sight lines"
    BORDER = "too near the border of the map"

    @property
    def in_words(self) -> str:
        """As the end of a sentence: "what blocks it is ..."."""
        return _IN_WORDS.get(self, f"the limit on {self}")


_IN_WORDS = {
    Reason.STEP: "a step that is too high",
    Reason.UNKNOWN_GROUND: "unknown ground",
    Reason.NO_GO: "a no-go area",
    Reason.KEEP_IN: "where the keep-in areas end",
    Reason.ANCHORS: "that too few anchors are in sight",
    Reason.MORPHING_MAP: "the morphing map",
    Reason.BUBBLE: "the safety bubble",
    Reason.SIGHT_LINE: "that a limit breaks by exact sight lines",
    Reason.BORDER: "the border of the map",
}


@dataclass(frozen=True, eq=False)
class PathTotals:
    """What a whole path amounts to; worst_dop is NaN without anchors, +inf where there is no fix somewhere.

    worst_dop, fewest_anchors: at the vertices and in each triangle between them; steepest_rad: of every triangle.
    mean_position_sigma_m: over the time of the path; NaN without anchors.
    """

    length_m: float
    climb_m: float
    descent_m: float
    time_s: float
    out_of_sight_s: float
    longest_out_of_sight_s: float
    worst_dop: float
    fewest_anchors: int
    mean_position_sigma_m: float
    steepest_rad: float


@dataclass(frozen=True, eq=False)
class Path:
    """A path over the ground; arrays have one entry for each of its n vertices, at most a cell apart.

    east_m, north_m, altitude_m: of the ground. heading_rad: of the way on, clockwise from grid north (the last one
        repeats). distance_m: along the ground from the start; time_s: from the start.
    slope_rad: of the steeper ground at the vertex; pitch_rad: of the way on, uphill positive; roll_rad: across it.
    visible: (n, anchors) bool by exact sight lines; anchor_count: (n,). dop: (n,), NaN without anchors.
    margin_m: sight clearance, metres, of the anchor that counts last for in-sight; negative = out of sight.
    clearance_m: to the nearest square that may not be driven for its ground or an area, or the border of the grid.
    position_sigma_m: root of the trace of the position's covariance that the filter will have; NaN without anchors.
    bubble_radius_m: NaN where no bubble is asked for.
    corners: (m,) vertices at which the way turns. cost, cost_split: in the units of the weights.
    """

    east_m: Numbers
    north_m: Numbers
    altitude_m: Numbers
    heading_rad: Numbers
    distance_m: Numbers
    time_s: Numbers
    slope_rad: Numbers
    pitch_rad: Numbers
    roll_rad: Numbers
    visible: npt.NDArray[np.bool_]
    anchor_count: npt.NDArray[np.int64]
    dop: Numbers
    margin_m: Numbers
    clearance_m: Numbers
    position_sigma_m: Numbers
    bubble_radius_m: Numbers
    corners: npt.NDArray[np.int64]
    cost: float
    cost_split: Mapping[str, float]
    totals: PathTotals


@dataclass(frozen=True, slots=True)
class Grain:
    """How fine a proof is.

    width_m: a way that has more than half of it free on either side all along does not exist; 0 = none at all.
    slope_rad: nor one over ground that is steeper than the limit by no more than this.
    """

    width_m: float
    slope_rad: float


@dataclass(frozen=True, slots=True)
class Relaxation:
    """One limit by itself that, set to ``needed`` instead of ``asked``, would let a path through; in its own unit.

    shown: whether a path was found with it that the validator passes; of unknown ground and of what lies beyond the
    border nobody can. least: with less there is no way for certain; NaN = not known.
    """

    reason: Reason
    asked: float
    needed: float
    sentence: str
    shown: bool = False
    least: float = math.nan


@dataclass(frozen=True, slots=True)
class Unreachable:
    """What blocks: the limit, where the way is cut (east_m, north_m), and each single relaxation, cheapest first.

    grain: how fine the proof is; None where nothing is proved.
    """

    reason: Reason
    where_m: tuple[float, float]
    relaxations: tuple[Relaxation, ...]
    grain: Grain | None = None


@dataclass(frozen=True, eq=False)
class PathOutcome:
    """The answer to ``plan_path``.

    sentence: the outcome in words. path: only when FOUND. unreachable: only when UNREACHABLE, or UNDECIDED, where it
        says what stopped the search.
    reference_cost: of the any-angle optimum over the same field; ratio: the path's cost over that; NaN without a path.
    validation: what the validator says of the path, and where REFUSED of the last one that it refused.
    reasons: (rows - 1, cols - 1) uint16, why squares of the field may not be driven: bits in the order of Reason.
    planner: which planner the path came from. first_path_s: until the first valid path was known, without maps.
    stopped_by: "count" where the budget's iterations ended the plan (one seed, one path), "time", "stop",
        "proof", or "grain" where all was searched as finely as it is and neither a way nor a proof was found.
    """

    status: PathStatus
    sentence: str
    path: Path | None
    unreachable: Unreachable | None
    validation: PathValidation | None
    reasons: npt.NDArray[np.uint16]
    reference_cost: float
    ratio: float
    planner: str
    stopped_by: str
    seed: int
    warnings: tuple[str, ...]
    first_path_s: float
    elapsed_s: float
    version: str


@dataclass(frozen=True, eq=False, slots=True)
class FlightOutcome:
    """The answer to ``plan_flight``: corners (n, 3) east, north, altitude; empty unless FOUND.

    margin_m: (n,) height over the floor of the square at each corner; clearance_m: least distance to the ground along
        the whole way. validation: what the validator says, of a refused flight too.
    stopped_by: "count" where the iterations ended the plan (one seed, one flight), "time", "stop",
        "proof" or "grain".
    """

    status: PathStatus
    sentence: str
    corners_m: Numbers
    margin_m: Numbers
    clearance_m: float
    cost: float
    planner: str
    stopped_by: str
    seed: int
    validation: PathValidation | None
    elapsed_s: float
