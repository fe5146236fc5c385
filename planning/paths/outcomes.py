"""The answer: how a plan ended, the path with what holds at each of its vertices, and what stood in the way."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:  # the validator takes its question from this package
    from planning.validation import PathValidation

__all__ = ["Path", "PathOutcome", "PathStatus", "PathTotals", "Reason", "Relaxation", "Unreachable"]

Numbers = npt.NDArray[np.float64]


class PathStatus(enum.StrEnum):
    """How a plan ended. FOUND paths have passed the validator; REFUSED: the validator found a fault in each."""

    FOUND = "found"
    REFUSED = "refused"
    UNREACHABLE = "unreachable"
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
class Relaxation:
    """One limit by itself that, set to ``needed`` instead of ``asked``, would let a path through; in its own unit."""

    reason: Reason
    asked: float
    needed: float
    sentence: str


@dataclass(frozen=True, slots=True)
class Unreachable:
    """What blocks: the limit, where the way is cut (east_m, north_m), and each single relaxation, cheapest first."""

    reason: Reason
    where_m: tuple[float, float]
    relaxations: tuple[Relaxation, ...]


@dataclass(frozen=True, eq=False)
class PathOutcome:
    """The answer to ``plan_path``.

    sentence: the outcome in words. path: only when FOUND. unreachable: only when UNREACHABLE.
    reference_cost: of the any-angle optimum over the same field; ratio: the path's cost over that; NaN without a path.
    validation: what the validator says of the path, and where REFUSED of the last one that it refused.
    reasons: (rows - 1, cols - 1) uint16, why squares of the field may not be driven: bits in the order of Reason.
    planner: which planner the path came from. first_path_s: until the first valid path was known, without maps.
    stopped_by: "count" where the budget's iterations ended the plan (one seed, one path), "time", "stop" or "proof".
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
