"""What a path must keep to, what it should avoid and at what price, and how long may be planned for it."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import get_args

from planning.errors import PathProblemError
from visibility.dilution import DopKind, least_anchors
from visibility.dilution.dop_questions import Measure

__all__ = ["MEASURES", "CostWeights", "PathLimits", "PlanBudget"]

MEASURES = get_args(Measure)


@dataclass(frozen=True, slots=True)
class PathLimits:
    """Limits on positioning that hold at every point of a path.

    min_anchors: at least so many anchors in sight, 0 = no limit. dop_limit: dilution below it (De Vivo et al.,
        eq. 15), inf = no limit.
    kind, measure, on_surface: which dilution, as in ``visibility.dop_map``.
    in_sight_from: how many anchors in sight make a place count as in sight; None = as many as a fix needs. A soft
        limit: see CostWeights.out_of_sight.
    bubble_epsilon: with a number above 0, what may not be driven stays further away than r = epsilon·sqrt(trace P) +
        dem_sigma_m at every point, P the covariance that the filter will have there (De Vivo et al., eqs. 25, 27).
    Raises PathProblemError, also where limits contradict one another.
    """

    min_anchors: int = 0
    dop_limit: float = math.inf
    kind: DopKind = "ranging"
    measure: Measure = "pdop"
    on_surface: bool = False
    in_sight_from: int | None = None
    bubble_epsilon: float = 0.0
    dem_sigma_m: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in get_args(DopKind):
            raise PathProblemError(f"kind must be one of {', '.join(get_args(DopKind))}, not {self.kind!r}.")
        if self.measure not in MEASURES:
            raise PathProblemError(f"measure must be one of {', '.join(MEASURES)}, not {self.measure!r}.")
        if self.min_anchors < 0 or (self.in_sight_from is not None and self.in_sight_from < 1):
            raise PathProblemError("min_anchors must be >= 0 and in_sight_from >= 1.")
        for name in ("bubble_epsilon", "dem_sigma_m"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise PathProblemError(f"{name} must be a number >= 0, not {getattr(self, name)}.")
        if not self.dop_limit > 0.0:
            raise PathProblemError(f"dop_limit must be a number > 0, not {self.dop_limit}.")

    @property
    def needed_in_sight(self) -> int:
        """How many anchors in sight make a place count as in sight."""
        if self.in_sight_from is not None:
            return self.in_sight_from
        return least_anchors(self.kind, on_surface=self.on_surface)

    @property
    def on_positioning(self) -> bool:
        """Whether anything is asked of the anchors."""
        return self.min_anchors > 0 or math.isfinite(self.dop_limit) or self.bubble_epsilon > 0.0


@dataclass(frozen=True, slots=True)
class CostWeights:
    """What a path costs, in units of a metre on level ground.

    length: of a metre along the ground. climb: of a metre climbed. time: of a second. dop: of a metre for each unit of
    dilution, which counts up to 20. out_of_sight: of a second with fewer anchors in sight than a fix needs.
    position_error: of a metre for each metre of predicted one-sigma position error, up to 100 m: the belief-aware mode.
    Raises PathProblemError.
    """

    length: float = 1.0
    climb: float = 2.0
    time: float = 0.0
    dop: float = 0.0
    out_of_sight: float = 2.0
    position_error: float = 0.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value >= 0.0):
                raise PathProblemError(f"The weight {field.name} must be a number >= 0, not {value}.")
        if self.length == self.time == 0.0:
            raise PathProblemError("A path must cost something for each metre: give length or time a weight > 0.")


@dataclass(frozen=True, slots=True)
class PlanBudget:
    """How much planning is paid for.

    iterations: of the sampling planner; the count that makes one seed give one path. seconds: time-out of the whole
    plan; a plan that it ends says so. sampling: whether the sampling planner runs at all; without it the answer is the
    grid's way, pulled straight. Raises PathProblemError.
    """

    iterations: int = 60_000
    seconds: float = 60.0
    sampling: bool = True

    def __post_init__(self) -> None:
        if self.iterations < 1 or not self.seconds > 0.0:
            raise PathProblemError(
                f"A budget needs at least one iteration and more than 0 s, not {self.iterations} and {self.seconds} s."
            )
