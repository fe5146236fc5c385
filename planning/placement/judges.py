"""Goals, and what targets are worth to them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol, get_args

import numpy as np
import numpy.typing as npt

from planning.errors import PlacementError
from planning.kernels import placement as kernel
from visibility.dilution import DopKind, least_anchors

from .sight import SightTable, pack, sampled_table, sampled_targets
from .targets import Targets

__all__ = ["CountJudge", "GeometryJudge", "Goal", "Judge", "Objective", "Problem", "judge_of", "sampled", "shown_value"]

Objective = Literal["coverage", "dop", "mean_error", "worst_error"]
Measure = Literal["gdop", "pdop", "hdop", "vdop"]
Floats = npt.NDArray[np.float64]
USUAL_COVERAGE = 4  # anchors in sight, where coverage is asked for without a number
# of the mean beside the worst: among sets with the same worst error the better mean wins
BESIDE_WORST = 1e-3
CODES = {"coverage": kernel.COVERAGE, "dop": kernel.DOP, "mean_error": kernel.ERROR, "worst_error": kernel.ERROR}
PARTS = {"gdop": kernel.POSITION, "pdop": kernel.POSITION, "hdop": kernel.HORIZONTAL, "vdop": kernel.VERTICAL}


@dataclass(frozen=True, slots=True)
class Goal:
    """What is wanted at the targets.

    objective: "coverage", the share of targets with at least ``min_anchors`` in sight (None = 4); "dop", the share that
        has a dilution of precision (``measure``) below ``dop_limit`` as well (None = as many as a fix needs);
        "mean_error" and "worst_error", the position error in metres over the targets, where every error counts at most
        ``worst_counted_m``.
    spare: how many anchors may be lost, any of them, 0 or 1: a target counts for what it has after the worst loss.
    ranging_sigma_m: of the anchors to be placed, for errors in metres.
    Raises PlacementError.
    """

    objective: Objective = "coverage"
    min_anchors: int | None = None
    dop_limit: float = 5.0
    measure: Measure = "pdop"
    kind: DopKind = "ranging"
    on_surface: bool = False
    spare: int = 0
    ranging_sigma_m: float = 0.1
    worst_counted_m: float = 10.0

    def __post_init__(self) -> None:
        for name, value, options in (
            ("objective", self.objective, get_args(Objective)),
            ("measure", self.measure, get_args(Measure)),
            ("kind", self.kind, get_args(DopKind)),
        ):
            if value not in options:
                raise PlacementError(f"{name} must be one of {', '.join(options)}, not {value!r}.")
        if (self.min_anchors is not None and self.min_anchors < 1) or self.spare not in (0, 1):
            raise PlacementError(f"min_anchors must be >= 1 and spare 0 or 1, not {self.min_anchors} and {self.spare}.")
        for name in ("dop_limit", "ranging_sigma_m", "worst_counted_m"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise PlacementError(f"{name} must be a number > 0, not {getattr(self, name)}.")
        if self.on_surface and self.measure not in ("pdop", "gdop"):
            raise PlacementError(f"A rover bound to the ground has one dilution, pdop; {self.measure} is not defined.")
        if self.measure == "gdop" and self.kind == "pseudorange":
            raise PlacementError("The gdop of pseudoranges cannot be placed for; ask for pdop, hdop or vdop.")

    @property
    def needed(self) -> int:
        """How many anchors must be in sight of a target before it can count, losses apart."""
        if self.objective == "coverage":
            return USUAL_COVERAGE if self.min_anchors is None else self.min_anchors
        least = least_anchors(self.kind, on_surface=self.on_surface)
        return max(self.min_anchors or 0, least) if self.objective == "dop" else least

    @property
    def needed_with_spare(self) -> int:
        """The same with the anchors that may be lost."""
        return self.needed + self.spare

    @property
    def is_share(self) -> bool:
        """Whether the objective is a share 0..1 of the targets; else it is metres."""
        return self.objective in ("coverage", "dop")

    @property
    def submodular(self) -> bool:
        """Whether greedy is within 1 − 1/e of the best: sharing out sight of one anchor, and of nothing else."""
        return self.objective == "coverage" and self.min_anchors == 1 and self.spare == 0

    def sentence(self) -> str:
        """In words."""
        lost = ", whichever one anchor is lost" if self.spare else ""
        of_ranges = f" of {self.kind} with a sigma of {self.ranging_sigma_m:g} m"
        measure = f"{self.measure.upper()}{' along the surface' if self.on_surface else ''} of {self.kind}"
        return {
            "coverage": f"share with at least {self.needed} in sight{lost}",
            "dop": f"share with at least {self.needed} in sight and {measure} < {self.dop_limit:g}{lost}",
            "mean_error": f"mean position error{of_ranges}, metres, counted up to {self.worst_counted_m:g} m{lost}",
            "worst_error": f"worst position error{of_ranges}, metres, counted up to {self.worst_counted_m:g} m{lost}",
        }[self.objective]


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
        self._base = problem.fixed_sight.visible().sum(axis=0).astype(np.int64)
        self._all_weight = targets.weight

    def value(self, chosen: list[int]) -> float:
        """Of a set."""
        return self._worth(self._counts(chosen))

    def with_each(self, chosen: list[int], which: npt.NDArray[np.intp]) -> Floats:
        """Of the set with each of some candidates added."""
        counts = self._counts(chosen)
        growing = counts < self._full if self._partial else counts == self._full - 1
        gain = self._under(growing & self._possible, which)
        return self._worth(counts) + gain / (self._full if self._partial else 1) / self._total

    def _counts(self, chosen: list[int]) -> npt.NDArray[np.int64]:
        counts: npt.NDArray[np.int64] = self._base.copy()
        for member in chosen:
            counts += self._sight.visible([member])[0]
        return counts

    def _worth(self, counts: npt.NDArray[np.int64]) -> float:
        reached = np.minimum(counts, self._full) / self._full if self._partial else counts >= self._full
        return float((reached * self._all_weight)[self._possible].sum() / self._total)

    def _under(self, mask: npt.NDArray[np.bool_], which: npt.NDArray[np.intp]) -> Floats:

        out = np.zeros(len(which))
        kernel.weight_under_mask(self._bits, which, pack(mask[None, :])[0], self._weight, out)
        return out * self._unit


class GeometryJudge:
    """Values that depend on where the anchors in sight are. information: log det of the information, submodular."""

    def __init__(self, problem: Problem, *, information: bool = False) -> None:
        self._problem = problem
        targets, goal = problem.targets, problem.goal
        self._rows = TargetRows(targets.point_m, targets.normal, targets.weight)
        self._aim = Aim(
            kernel.INFORMATION if information else CODES[goal.objective],
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
        return self._joined(float(values @ self._problem.targets.weight), float(values.min()))

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
