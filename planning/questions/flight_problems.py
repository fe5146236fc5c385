"""The question of a flight."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from planning.errors import PathProblemError
from planning.questions.limits import PlanBudget
from planning.questions.problems import check_ground
from terrain import ElevationGrid
from visibility.air import MorphingMap

__all__ = ["FlightProblem"]

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
