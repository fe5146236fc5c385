"""The question of a flight, and its answer."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from planning.errors import PathProblemError
from terrain import ElevationGrid
from visibility import MorphingMap

from .limits import PlanBudget
from .outcomes import PathStatus
from .problems import check_ground

if TYPE_CHECKING:  # the validator takes its question from this package
    from planning.validation import PathValidation

__all__ = ["FlightOutcome", "FlightProblem"]

Floats = npt.NDArray[np.float64]
Point = tuple[float, float, float]


@dataclass(frozen=True, eq=False, slots=True)
class FlightProblem:
    """From where to where, (east_m, north_m, altitude_m), above what.

    above: a morphing map whose safe_above_m is the floor and whose ceiling is the ceiling; None = the ground alone.
    ceiling_m: an altitude, or with ceiling_above_ground a height over each place; inf = none but the map's.
    bubble_m: distance that is kept from all ground, d >= r of eq. 25. climb_weight: what a metre of climb costs besides
        a metre of way. Raises PathProblemError.
    """

    grid: ElevationGrid
    start: Point
    goal: Point
    above: MorphingMap | None = None
    ceiling_m: float = math.inf
    ceiling_above_ground: bool = False
    bubble_m: float = 20.0
    climb_weight: float = 1.0
    seed: int = 0
    budget: PlanBudget = field(default_factory=lambda: PlanBudget(iterations=20_000))

    def __post_init__(self) -> None:
        check_ground(self.grid)
        for name in ("start", "goal"):
            if len(getattr(self, name)) != 3 or not all(math.isfinite(number) for number in getattr(self, name)):
                raise PathProblemError(f"The {name} of a flight must be east_m, north_m and altitude_m, finite.")
        if tuple(self.start) == tuple(self.goal):
            raise PathProblemError("The start and the goal are the same place, so there is no flight to plan.")
        for name in ("bubble_m", "climb_weight"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise PathProblemError(f"{name} must be a number >= 0, not {getattr(self, name)}.")
        if not self.ceiling_m > -math.inf:
            raise PathProblemError(f"ceiling_m must be a number of metres, not {self.ceiling_m}.")
        if not 0 <= self.seed < 2**32:
            raise PathProblemError(f"seed must be a whole number from 0 to {2**32 - 1}, not {self.seed}.")
        if self.above is not None and self.above.grid.digest != self.grid.digest:
            raise PathProblemError("The morphing map belongs to another grid; calculate it for this one.")


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
    corners_m: Floats
    margin_m: Floats
    clearance_m: float
    cost: float
    planner: str
    stopped_by: str
    seed: int
    validation: PathValidation | None
    elapsed_s: float
