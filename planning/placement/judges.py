"""What sets of anchors are worth to a goal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from planning.kernels import placement as kernel
from planning.kernels import placement_bits

from .goals import Goal
from .sight import SightTable, pack, sampled_table, sampled_targets
from .targets import Targets

__all__ = ["CountJudge", "GeometryJudge", "Judge", "Problem", "judge_of", "sampled", "shown_value"]

Floats = npt.NDArray[np.float64]
# of the mean beside the worst: among sets with the same worst error the better mean wins
BESIDE_WORST = 1e-3
CODES = {"coverage": kernel.COVERAGE, "dop": kernel.DOP, "mean_error": kernel.ERROR, "worst_error": kernel.ERROR}
PARTS = {"gdop": kernel.POSITION, "pdop": kernel.POSITION, "hdop": kernel.HORIZONTAL, "vdop": kernel.VERTICAL}


class TargetRows(NamedTuple):
    """Targets as kernels take them: point_m and unit normal (m, 3), weight (m,)."""

    point_m: Floats
    normal: Floats
    weight: Floats


class Aim(NamedTuple):
    """What a target is worth, as kernels take it.

    objective, part: codes of the kernels. needed: anchors in sight. limit2: square of the dilution's limit. clock:
    whether the receiver's clock is unknown too. spare: how many may be lost. worst_m: an error counts at most so much.
    """

    objective: int
    needed: int
    limit2: float
    clock: bool
    part: int
    on_surface: bool
    spare: int
    worst_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Targets, what sees them, and what is wanted. anchor: (n, 4) candidates as east, north, altitude, weight.

    fixed: (f, 4), fixed_sight: those always there.
    """

    targets: Targets
    goal: Goal
    anchor: Floats
    sight: SightTable
    fixed: Floats
    fixed_sight: SightTable


class Judge(Protocol):
    """Values of sets: the larger the better; a share, or metres with a minus sign."""

    def value(self, chosen: list[int]) -> float:
        """Of a set of candidates."""
        ...

    def with_each(self, chosen: list[int], which: npt.NDArray[np.intp]) -> Floats:
        """(r,) of the set with each of some candidates added."""
        ...


class CountJudge:
    """Weight of targets by how many anchors they see, up to ``full``.

    partial: a target with n < full in sight counts n / full, which is submodular; else it counts nothing.
    possible: (m,) bool, targets that count at all.
    """

    def __init__(
        self, problem: Problem, full: int, *, partial: bool, possible: npt.NDArray[np.bool_] | None = None
    ) -> None:
        self._bits, self._full, self._partial = problem.sight.bits, full, partial
        targets = problem.targets
        uniform = bool((targets.weight == targets.weight[0]).all())
        self._unit = float(targets.weight[0]) if uniform else 1.0
        self._weight = np.zeros(0) if uniform else targets.weight
        self._total = targets.total
        self._sight = problem.sight
        self._possible = np.ones(len(targets), np.bool_) if possible is None else possible
        self._fixed_bits = problem.fixed_sight.bits
        self._base = problem.fixed_sight.visible().sum(axis=0).astype(np.int64)
        self._all_weight = targets.weight

    def value(self, chosen: list[int]) -> float:
        """Of a set."""
        return self._worth(self._counts(chosen)) if self._partial else self._weight_of(self._masks(chosen)[0])

    def with_each(self, chosen: list[int], which: npt.NDArray[np.intp]) -> Floats:
        """Of the set with each of some candidates added."""
        if self._partial:
            counts = self._counts(chosen)
            growing = pack(((counts < self._full) & self._possible)[None, :])[0]
            return self._worth(counts) + self._under(growing, which) / self._full / self._total
        reached, short = self._masks(chosen)
        return self._weight_of(reached) + self._under(short, which) / self._total

    def _masks(self, chosen: list[int]) -> tuple[npt.NDArray[np.uint64], npt.NDArray[np.uint64]]:
        """Bits of the targets that see enough, and of those that see one too few."""
        reached = np.empty(self._bits.shape[1], np.uint64)
        short = np.empty_like(reached)
        placement_bits.count_masks(np.concatenate([self._fixed_bits, self._bits[chosen]]), self._full, reached, short)
        return reached, short

    def _weight_of(self, reached: npt.NDArray[np.uint64]) -> float:
        """Share of the weight that these bits have."""
        out = np.empty(1)
        placement_bits.weight_under_mask(reached[None, :], np.zeros(1, np.intp), reached, self._weight, out)
        return float(out[0]) * self._unit / self._total

    def _counts(self, chosen: list[int]) -> npt.NDArray[np.int64]:
        counts: npt.NDArray[np.int64] = self._base.copy()
        for member in chosen:
            counts += self._sight.visible([member])[0]
        return counts

    def _worth(self, counts: npt.NDArray[np.int64]) -> float:
        reached = np.minimum(counts, self._full) / self._full
        return float((reached * self._all_weight)[self._possible].sum() / self._total)

    def _under(self, mask: npt.NDArray[np.uint64], which: npt.NDArray[np.intp]) -> Floats:
        out = np.zeros(len(which))
        placement_bits.weight_under_mask(self._bits, which, mask, self._weight, out)
        return out * self._unit


class GeometryJudge:
    """Values that depend on where the anchors in sight are. information: log det of the information, submodular."""

    def __init__(self, problem: Problem, *, information: bool = False) -> None:
        self._problem = problem
        targets, goal = problem.targets, problem.goal
        self._rows = TargetRows(targets.point_m, targets.normal, targets.weight)
        self._aim = Aim(
            kernel.INFORMATION if information else CODES[goal.wanted],
            goal.needed,
            goal.dop_limit**2,
            goal.kind != "ranging",
            PARTS[goal.measure],
            goal.on_surface,
            goal.spare,
            goal.worst_counted_m,
        )
        self._worst = goal.objective == "worst_error" and not information

    def value(self, chosen: list[int]) -> float:
        """Of a set."""
        values = self.of_targets(chosen)
        # not their product as vectors, which rounds by how many threads work it out
        return self._joined(float((values * self._problem.targets.weight).sum()), float(values.min()))

    def of_targets(self, chosen: list[int]) -> Floats:
        """(m,) what each target is worth."""
        return self._states(*self._present(chosen))[:, kernel.VALUE].copy()

    def with_each(self, chosen: list[int], which: npt.NDArray[np.intp]) -> Floats:
        """Of the set with each of some candidates added."""
        present, bits = self._present(chosen)
        states = self._states(present, bits)
        out = np.empty((len(which), 2))
        problem = self._problem
        rows = (problem.anchor[which], problem.sight.bits[which])
        kernel.additions(self._rows, states, present, bits, *rows, self._aim, out)
        if not self._worst:
            return out[:, kernel.TOTAL] / problem.targets.total
        return out[:, kernel.LEAST] + BESIDE_WORST * out[:, kernel.TOTAL] / problem.targets.total

    def _joined(self, total: float, least: float) -> float:
        mean = total / self._problem.targets.total
        return least + BESIDE_WORST * mean if self._worst else mean

    def _present(self, chosen: list[int]) -> tuple[Floats, npt.NDArray[np.uint64]]:
        problem = self._problem
        return (
            np.concatenate([problem.fixed, problem.anchor[chosen]]),
            np.concatenate([problem.fixed_sight.bits, problem.sight.bits[chosen]]),
        )

    def _states(self, present: Floats, bits: npt.NDArray[np.uint64]) -> Floats:
        states = np.zeros((len(self._problem.targets), kernel.STATE_COLUMNS))
        kernel.fill_states(self._rows, present, bits, self._aim, states)
        return states


def judge_of(problem: Problem) -> Judge:
    """The judge of a problem's goal."""
    goal = problem.goal
    if goal.objective == "coverage":
        return CountJudge(problem, goal.needed_with_spare, partial=False)
    return GeometryJudge(problem)


def sampled(problem: Problem, which: npt.NDArray[np.intp]) -> Problem:
    """The same problem with some of its targets."""
    return Problem(
        sampled_targets(problem.targets, which),
        problem.goal,
        problem.anchor,
        sampled_table(problem.sight, which),
        problem.fixed,
        sampled_table(problem.fixed_sight, which),
    )


def shown_value(problem: Problem, chosen: list[int]) -> float:
    """The value of a set as people read it: a share 0..1, or metres, the worst without the mean beside it."""
    judge = judge_of(problem)
    if problem.goal.objective != "worst_error":
        value = judge.value(chosen)
        return value if problem.goal.is_share else -value
    assert isinstance(judge, GeometryJudge)
    return float(-judge.of_targets(chosen).min())
