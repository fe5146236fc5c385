"""How a plan ends, and in which words."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

from planning.questions.problems import PathProblem
from planning.validation import PathValidation
from terrain import ElevationGrid, told_place
from terrain.version import VERSION

from .fields import CostField
from .outcomes import Path, PathOutcome, PathStatus, Unreachable

__all__ = ["Endings"]

Stop = Callable[[], bool]


class Endings:
    """What every outcome of one plan has in common, and the outcomes."""

    def __init__(self, problem: PathProblem, told: Callable[[float], None], stop: Stop, begin_s: float) -> None:
        self.problem, self.told, self.stop, self.begin_s = problem, told, stop, begin_s
        self.first_path_s = math.nan
        self.warnings: tuple[str, ...] = ()
        self.field: CostField

    def ended(self) -> bool:
        """Whether the plan was stopped or its time is up."""
        return self.stop() or time.perf_counter() - self.begin_s > self.problem.budget.seconds

    def found(
        self, path: Path, validation: PathValidation, reference: float, planner: str, completed: bool
    ) -> PathOutcome:
        """A path that the validator passed; completed: not ended by the clock or a request."""
        self.told(1.0)
        sentence = f"A path of {path.totals.length_m:,.0f} m was found that takes {path.totals.time_s:,.0f} s."
        return replace(
            self.answer(PathStatus.FOUND, sentence, planner, "count" if completed else self.ended_by),
            path=path,
            validation=validation,
            reference_cost=reference,
            ratio=path.cost / reference,
        )

    def refused(self, validation: PathValidation) -> PathOutcome:
        """The validator found a fault in what was planned."""
        sentence = f"A path was planned that the validator refuses: {validation.sentence}"
        return replace(self.answer(PathStatus.REFUSED, sentence, "none", "count"), validation=validation)

    def unreachable(self, unreachable: Unreachable) -> PathOutcome:
        """There is no way, to the grain of the proof."""
        assert unreachable.grain is not None, "what is unreachable is proved"
        width_m = unreachable.grain.width_m
        spare = f" with {_told_m(0.5 * width_m)} m or more to spare on either side" if width_m > 0.0 else ""
        sentence = f"There is no way{spare}: {_blocks(self.problem.grid, unreachable)}"
        return replace(self.answer(PathStatus.UNREACHABLE, sentence, "grid", "proof"), unreachable=unreachable)

    def undecided(self, blocked: Unreachable, why: str) -> PathOutcome:
        """Neither a way nor the proof that there is none was found."""
        what = _blocks(self.problem.grid, blocked)
        sentence = f"No way was found, and that there is none is not proved, for {why}: {what}"
        return replace(self.answer(PathStatus.UNDECIDED, sentence, "none", "grain"), unreachable=blocked)

    def out_of_budget(self, sentence: str) -> PathOutcome:
        """Ended before there was a path."""
        return self.answer(PathStatus.OUT_OF_BUDGET, sentence, "none", self.ended_by)

    @property
    def ended_by(self) -> str:
        """What ended a plan before its work was done."""
        return "stop" if self.stop() else "time"

    def answer(self, status: PathStatus, sentence: str, planner: str, stopped_by: str) -> PathOutcome:
        """What every outcome has; a path or a proof is added by its own."""
        return PathOutcome(
            status=status,
            sentence=sentence,
            path=None,
            unreachable=None,
            validation=None,
            reasons=self.field.reasons,
            reference_cost=math.nan,
            ratio=math.nan,
            planner=planner,
            stopped_by=stopped_by,
            seed=self.problem.seed,
            warnings=self.warnings,
            first_path_s=self.first_path_s,
            elapsed_s=time.perf_counter() - self.begin_s,
            version=VERSION,
        )


def _blocks(grid: ElevationGrid, found: Unreachable) -> str:
    """What blocks, where, and what would open a way."""
    sentence = f"what blocks it near {told_place(grid, *found.where_m)} is {found.reason.in_words}."
    if not found.relaxations:
        return f"{sentence} No single limit would open one by giving way."
    cheapest = found.relaxations[0]
    there_is = "There is one" if cheapest.shown else "There may be one, which was not shown,"
    return f"{sentence} {there_is} {cheapest.sentence}."


def _told_m(metres: float) -> str:
    """Metres in two figures, rounded up, so that what is said stays true."""
    digits = max(1 - math.floor(math.log10(metres)), 0)
    return f"{math.ceil(metres * 10.0**digits) / 10.0**digits:.{digits}f}"
