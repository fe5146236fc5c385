"""From a problem to an outcome: maps, field, proof on the grid, planners, and the check of what comes out."""

from __future__ import annotations

import importlib.metadata
import math
import time
from collections.abc import Callable

from visibility import MinimumVisibleAltitude, min_visible_altitude

from .describing import described
from .ends import ends_of
from .fields import CostField, cost_field
from .outcomes import Path, PathOutcome, PathStatus, Unreachable
from .problems import PathProblem
from .proof import proof_of
from .sight_checks import without_hidden_squares
from .ways import EIGHT, SIXTEEN, Way, grid_way, straightened

__all__ = ["plan_path"]

Stop = Callable[[], bool]

# a path that exact sight lines refuse somewhere is planned again without those squares, at most so often
MOST_REPAIRS = 40


def plan_path(
    problem: PathProblem,
    *,
    progress: Callable[[float], None] | None = None,
    stop: Stop | None = None,
) -> PathOutcome:
    """Plan a path that keeps every limit at every point, as cheap as the budget allows.

    progress: called with the finished share 0..1. stop: asked again and again; once it says True the plan ends as out
    of budget. Raises PathProblemError, AreaError, PlaceError, NoCoverageError, AnchorError.
    """
    plan = _Plan(problem, progress or (lambda _: None), stop or (lambda: False))
    return plan.outcome()


class _Plan:
    """One run of ``plan_path``: what is known so far."""

    def __init__(self, problem: PathProblem, told: Callable[[float], None], stop: Stop) -> None:
        self.problem, self.told, self.stop = problem, told, stop
        self.begin_s = time.perf_counter()
        self.first_path_s = math.nan

    def ended(self) -> bool:
        """Whether the plan was stopped or its time is up."""
        return self.stop() or time.perf_counter() - self.begin_s > self.problem.budget.seconds

    def outcome(self) -> PathOutcome:
        problem = self.problem
        minimum = _minimum(problem)
        self.told(0.3)
        field = cost_field(problem, minimum)
        ready_s = time.perf_counter()
        for _ in range(MOST_REPAIRS):
            ends = ends_of(problem, field)
            first, leg = grid_way(field.for_kernels(), ends, EIGHT)
            if first is None:
                first, leg = grid_way(field.for_kernels(), ends, SIXTEEN)
            if first is None:
                return self._unreachable(proof_of(problem, field, ends, leg))
            if math.isnan(self.first_path_s):
                self.first_path_s = time.perf_counter() - ready_s
            fixed = [end.places[0] for end in ends[1:-1]]
            searched = grid_way(field.for_kernels(), ends, SIXTEEN)[0]
            assert searched is not None, "more moves reach no less"
            best = straightened(field.for_kernels(), searched, fixed, stop=self.ended)
            reference = best.cost
            if self.ended():
                return self._out_of_budget("The time for planning was over before the path was checked.")
            repaired = without_hidden_squares(problem, field, minimum, best.places)
            if repaired is None:
                return self._found(field, minimum, best, reference)
            field = repaired
        return self._out_of_budget(
            f"The exact sight lines refused {MOST_REPAIRS} paths in a row; give limits on positioning more room."
        )

    def _found(
        self, field: CostField, minimum: MinimumVisibleAltitude | None, way: Way, reference: float
    ) -> PathOutcome:
        path = described(self.problem, field, minimum, way.places)
        self.told(1.0)
        totals = path.totals
        sentence = f"A path of {totals.length_m:,.0f} m was found, {totals.time_s:,.0f} s long."
        return self._answer(PathStatus.FOUND, sentence, path, None, reference, "count")

    def _unreachable(self, unreachable: Unreachable) -> PathOutcome:
        east_m, north_m = unreachable.where_m
        sentence = f"There is no way: {unreachable.reason} blocks it near ({east_m:.0f} m east, {north_m:.0f} m north)."
        if unreachable.relaxations:
            sentence += f" There is one {unreachable.relaxations[0].sentence}."
        else:
            sentence += " No single limit would open one by giving way."
        return self._answer(PathStatus.UNREACHABLE, sentence, None, unreachable, math.nan, "proof")

    def _out_of_budget(self, sentence: str) -> PathOutcome:
        return self._answer(PathStatus.OUT_OF_BUDGET, sentence, None, None, math.nan, "time")

    def _answer(
        self,
        status: PathStatus,
        sentence: str,
        path: Path | None,
        unreachable: Unreachable | None,
        reference: float,
        stopped_by: str,
    ) -> PathOutcome:
        return PathOutcome(
            status=status,
            sentence=sentence,
            path=path,
            unreachable=unreachable,
            reference_cost=reference,
            ratio=math.nan if path is None else path.cost / reference,
            planner="grid",
            stopped_by=stopped_by,
            seed=self.problem.seed,
            warnings=(),
            first_path_s=self.first_path_s,
            elapsed_s=time.perf_counter() - self.begin_s,
            version=importlib.metadata.version("sightline"),
        )


def _minimum(problem: PathProblem) -> MinimumVisibleAltitude | None:
    if problem.minimum is not None:
        return problem.minimum
    return min_visible_altitude(problem.grid, problem.anchors, "exact") if problem.anchors else None
