"""Several ways that differ, each within every limit, and what each is worth beside the cheapest."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt
import scipy

from planning.errors import PathProblemError, PlaceError
from planning.paths.checks import without_broken_squares, without_refused_squares
from planning.paths.corridors import EIGHT, grid_way, straightened
from planning.paths.describing import described
from planning.paths.ends import arrivals_along, ends_of, fastest_arrivals_s
from planning.paths.fields import CostField, cost_field
from planning.paths.outcomes import Path, PathOutcome, PathStatus
from planning.paths.places import Cells
from planning.paths.sight_maps import sight_maps
from planning.questions.models import CostWeights
from planning.questions.problems import PathProblem
from planning.validation import PathValidation, validate_path
from planning.words import more_or_less, time_words

__all__ = ["Alternative", "Alternatives", "alternatives_to"]

Floats = npt.NDArray[np.float64]
What = Literal["shortest", "in sight", "surest", "another way"]

MOST_ALTERNATIVES = 8
# two ways differ where at least so much of one is further than so much from the other
LEAST_APART = 0.25
APART_OF_LENGTH, APART_CELLS = 0.02, 3.0
# weights of the ways that are after one thing alone, beside those that were asked for
IN_SIGHT, SUREST = 20.0, 20.0
# a metre near a way that is known costs so many times more, ever more until a way avoids it
FIRST_PENALTY, MOST_DOUBLINGS = 0.5, 5
MOST_REPAIRS = 12


@dataclass(frozen=True, slots=True, eq=False)
class Alternative:
    """A way that differs from the others.

    what: what it is after: "shortest", "in sight", "surest" (of its position), or merely "another way".
    apart: share 0..1 of its length that is further than ``Alternatives.apart_m`` from every way before it.
    sentence: what it is worth beside the first, in words. path, validation: as of a plan.
    """

    what: What
    path: Path
    validation: PathValidation
    apart: float
    sentence: str


@dataclass(frozen=True, slots=True, eq=False)
class Alternatives:
    """Ways beside the one that was found: as many as were asked for, or all that differ enough.

    apart_m: a way differs where a quarter of it is further than this from every way before it.
    sentence: how many there are, and why not more. ended: the budget or a request ended the search for them.
    """

    paths: tuple[Alternative, ...]
    apart_m: float
    sentence: str
    ended: bool


def alternatives_to(
    problem: PathProblem,
    outcome: PathOutcome,
    count: int,
    *,
    within_s: float = math.inf,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> Alternatives:
    """Up to ``count`` ways that differ from a plan's path and from each other, each passed by the validator.

    First those that are after one thing alone (length, sight, a sure position), then those that avoid what is known.
    within_s: none that takes longer. The time that the plan took counts to the budget's seconds. progress: called
    with the finished share 0..1. Raises PathProblemError, NoCoverageError, AnchorError.
    """
    if not 1 <= count <= MOST_ALTERNATIVES:
        raise PathProblemError(f"Alternatives are 1 to {MOST_ALTERNATIVES} ways, not {count}.")
    if problem.rover.min_turning_radius_m > 0.0:
        raise PathProblemError("Alternatives are looked for only for a rover that turns on the spot.")
    if outcome.status is not PathStatus.FOUND or outcome.path is None:
        return Alternatives((), math.nan, "Without a path there are no alternatives to it.", False)
    begin_s = time.perf_counter() - outcome.elapsed_s

    def ended() -> bool:
        over = time.perf_counter() - begin_s > problem.budget.seconds
        return over or (stop is not None and stop())

    search = _Search(problem, outcome, outcome.path, within_s, ended)
    found = search.found(count, progress or _nobody)
    return Alternatives(found, search.apart_m, _sentence(len(found), count, ended()), ended())


def _nobody(_: float) -> None:
    """Tells nobody of progress."""


class _Search:
    """What is known while alternatives to one path are looked for."""

    def __init__(
        self, problem: PathProblem, outcome: PathOutcome, first: Path, within_s: float, ended: Callable[[], bool]
    ) -> None:
        self._problem, self._first, self._within_s, self._ended = problem, first, within_s, ended
        # so that dilutions are known wherever any of the fields may ask for them
        wide = replace(
            problem, weights=replace(problem.weights, position_error=max(problem.weights.position_error, 1.0))
        )
        self._maps = sight_maps(wide)
        self._arrival_s = self._arrivals() if problem.moves else None
        # squares that exact sight lines refused on the way to the first path stay refused
        self._field = replace(cost_field(problem, self._maps, self._arrival_s), reasons=outcome.reasons)
        cells = Cells.of(problem.grid)
        self.apart_m = max(APART_CELLS * max(cells), APART_OF_LENGTH * first.totals.length_m)

    def _arrivals(self) -> Floats:
        """When the rover gets to each square while it drives the first path."""
        timed = cost_field(self._problem, self._maps)
        return arrivals_along(timed, fastest_arrivals_s(self._problem, timed), _posts(self._problem, self._first))

    def found(self, count: int, progress: Callable[[float], None]) -> tuple[Alternative, ...]:
        """The ways, best known first."""
        kept: list[Alternative] = []

        def keep(what: What, field: CostField) -> bool:
            if self._ended():
                return False
            judged = self._judged(field)
            if judged is None or judged[0].totals.time_s > self._within_s:
                return False
            apart = self._apart(judged[0], [self._first, *(one.path for one in kept)])
            if apart >= LEAST_APART:
                kept.append(Alternative(what, *judged, apart, _worth(judged[0], self._first, self._maps is not None)))
                progress(len(kept) / count)
            return apart >= LEAST_APART

        for what, weights in self._wishes():
            if len(kept) < count:
                keep(what, self._weighing(weights))
        doublings = 0
        while len(kept) < count and doublings < MOST_DOUBLINGS and not self._ended():
            known = [self._first, *(one.path for one in kept)]
            if not keep("another way", self._avoiding(known, FIRST_PENALTY * 2.0**doublings)):
                doublings += 1
        return tuple(kept)

    def _wishes(self) -> Iterator[tuple[What, CostWeights]]:
        """Weights of the ways that are after one thing alone."""
        weights = self._problem.weights
        yield "shortest", CostWeights(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        if self._maps is not None:
            yield "in sight", replace(weights, out_of_sight=max(weights.out_of_sight, 1.0) * IN_SIGHT)
            yield "surest", replace(weights, position_error=max(weights.position_error, 1.0) * SUREST)

    def _weighing(self, weights: CostWeights) -> CostField:
        """The field with other weights."""
        return replace(
            cost_field(replace(self._problem, weights=weights), self._maps, self._arrival_s),
            reasons=self._field.reasons,
        )

    def _avoiding(self, paths: Sequence[Path], penalty: float) -> CostField:
        """The field in which metres near paths cost more."""
        grid, first = self._problem.grid, self._first
        away = np.ones(self._field.reasons.shape, np.bool_)
        for path in paths:
            rows, cols = np.minimum(_posts(self._problem, path).astype(np.intp), np.array(away.shape) - 1).T
            away[rows, cols] = False
        away_m = scipy.ndimage.distance_transform_edt(away, sampling=(grid.cell_north_m, grid.cell_east_m))
        # evenly less with the distance, so that a way is drawn away and not only held out
        share = np.clip(2.0 - away_m / self.apart_m, 0.0, 1.0).astype(np.float32)
        per_m = np.float32(penalty * first.cost / max(first.totals.length_m, 1e-9))
        return replace(self._field, added=self._field.added + per_m * share)

    def _judged(self, field: CostField) -> tuple[Path, PathValidation] | None:
        """The cheapest way over a field, if exact sight lines and the validator pass it after some repairs."""
        problem = self._problem
        for _ in range(MOST_REPAIRS):
            kernel_field = field.for_kernels()
            try:
                ends = ends_of(problem, field, self._maps)
            except PlaceError:
                return None
            way, _ = grid_way(kernel_field, ends, EIGHT)
            if way is None or self._ended():
                return None
            way = straightened(kernel_field, way, tuple(end.places[0] for end in ends[1:-1]), stop=self._ended)
            repaired = without_broken_squares(problem, field, self._maps, way.places)
            if repaired is None:
                asked = replace(self._field, reasons=field.reasons)
                path = described(problem, asked, self._maps, way.places)
                validation = validate_path(problem, np.column_stack([path.east_m, path.north_m]))
                if validation.passed:
                    return path, validation
                repaired = without_refused_squares(field, validation)
            if repaired is None:
                return None
            field = repaired
        return None

    def _apart(self, path: Path, others: Sequence[Path]) -> float:
        """Share of a path's length that is away from all of the others."""
        piece_m = np.diff(path.distance_m)
        places = np.column_stack([path.east_m, path.north_m])
        middle = 0.5 * (places[:-1] + places[1:])
        tree = scipy.spatial.cKDTree(np.concatenate([np.column_stack([one.east_m, one.north_m]) for one in others]))
        return float(piece_m[tree.query(middle)[0] > self.apart_m].sum() / piece_m.sum())


def _posts(problem: PathProblem, path: Path) -> Floats:
    """(n, 2) fractional posts of a path's vertices."""
    return np.array([problem.grid.post_at(*place) for place in zip(path.east_m, path.north_m, strict=True)], np.float64)


def _worth(path: Path, first: Path, ranged: bool) -> str:
    """What a path is worth beside the first, in words."""
    here, there = path.totals, first.totals
    told = [f"{here.length_m:,.0f} m ({here.length_m / there.length_m - 1.0:+.0%})"]
    told.append(f"{time_words(here.time_s)} ({more_or_less(here.time_s - there.time_s)})")
    if ranged:
        more_s = here.out_of_sight_s - there.out_of_sight_s
        told.append(f"{time_words(here.out_of_sight_s)} out of sight ({more_or_less(more_s)})")
        change_m = here.mean_position_sigma_m - there.mean_position_sigma_m
        told.append(f"position error {here.mean_position_sigma_m:.2f} m ({change_m:+.2f} m)")
    return ", ".join(told)


def _sentence(found: int, count: int, ended: bool) -> str:
    ways = f"{found} other way{'' if found == 1 else 's'}"
    if found == count:
        return f"{ways} that differ{'s' if found == 1 else ''} enough."
    why = "the time was up before more were found" if ended else "no more were found that differ enough"
    return f"{ways}: {why}."
