"""When to leave: with anchors that move, another departure may have another way, or the only one."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from planning.errors import NoCoverageError, PathProblemError, PlaceError
from planning.paths.outcomes import PathOutcome, PathStatus
from planning.paths.planning import plan_path
from planning.questions.problems import PathProblem
from planning.words import time_words

__all__ = ["Departure", "Departures", "plan_departures"]

MOST_DEPARTURES = 32
LEAST_S = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Departure:
    """A plan that leaves at a time, on the clock of the anchors.

    outcome: None where a limit holds nowhere, or the start or goal is forbidden then, which why tells. arrival_s: NaN
    without a path. in_time: whether there is a path that arrives within the window.
    """

    departure_s: float
    outcome: PathOutcome | None
    arrival_s: float
    in_time: bool
    why: str


@dataclass(frozen=True, slots=True, eq=False)
class Departures:
    """Plans over a window of time. best: the cheapest that arrives in time, of equal ones the soonest; None = none.

    sentence: which departure is best, or what there is instead. ended: the budget or a request ended the search.
    """

    tried: tuple[Departure, ...]
    best: Departure | None
    sentence: str
    ended: bool


def plan_departures(
    problem: PathProblem,
    leave_by_s: float,
    *,
    arrive_by_s: float = math.inf,
    count: int = 5,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> Departures:
    """Plans that leave at ``count`` times, evenly from the problem's departure_s to leave_by_s, on the grid alone.

    arrive_by_s: when the rover has to be there. The budget's seconds are those of all plans together.
    Raises PathProblemError, AreaError, AnchorError.
    """
    if not problem.moves:
        raise PathProblemError("Departures differ only with anchors that move; leave the window out.")
    if not (math.isfinite(leave_by_s) and leave_by_s > problem.departure_s):
        raise PathProblemError(
            f"leave_by_s must be after departure_s, {problem.departure_s:g} s, not {leave_by_s:g} s."
        )
    if not arrive_by_s > problem.departure_s:
        raise PathProblemError(
            f"arrive_by_s must be after departure_s, {problem.departure_s:g} s, not {arrive_by_s:g} s."
        )
    if not 2 <= count <= MOST_DEPARTURES:
        raise PathProblemError(f"Departures are 2 to {MOST_DEPARTURES}, not {count}.")
    begin_s = time.perf_counter()

    def ended() -> bool:
        over = time.perf_counter() - begin_s > problem.budget.seconds
        return over or (stop is not None and stop())

    on_the_grid = replace(problem, budget=replace(problem.budget, sampling=False))
    tried: list[Departure] = []
    for departure_s in np.linspace(problem.departure_s, leave_by_s, count).tolist():
        if tried and ended():
            break
        left_s = max(problem.budget.seconds - (time.perf_counter() - begin_s), LEAST_S)
        one = replace(on_the_grid, departure_s=departure_s, budget=replace(on_the_grid.budget, seconds=left_s))
        tried.append(_departure(one, arrive_by_s, stop))
        if progress is not None:
            progress(len(tried) / count)
    good = [one for one in tried if one.in_time]
    best = min(good, key=_cost, default=None)
    early = len(tried) < count
    sentence = _sentence(tried, best, arrive_by_s) + (" The search ended before more were tried." if early else "")
    return Departures(tuple(tried), best, sentence, early)


def _departure(problem: PathProblem, arrive_by_s: float, stop: Callable[[], bool] | None) -> Departure:
    try:
        outcome = plan_path(problem, stop=stop)
    except (NoCoverageError, PlaceError) as fault:
        return Departure(problem.departure_s, None, math.nan, False, str(fault))
    if outcome.status is not PathStatus.FOUND or outcome.path is None:
        return Departure(problem.departure_s, outcome, math.nan, False, outcome.sentence)
    arrival_s = problem.departure_s + outcome.path.totals.time_s
    return Departure(problem.departure_s, outcome, arrival_s, arrival_s <= arrive_by_s, outcome.sentence)


def _cost(departure: Departure) -> float:
    """Of one that has a path."""
    assert departure.outcome is not None
    assert departure.outcome.path is not None
    return departure.outcome.path.cost


def _sentence(tried: list[Departure], best: Departure | None, arrive_by_s: float) -> str:
    tries = f"{len(tried)} departure{'' if len(tried) == 1 else 's'}"
    late = [one.arrival_s for one in tried if math.isfinite(one.arrival_s) and not one.in_time]
    if best is not None:
        least = f"costs least of those that arrive by {time_words(arrive_by_s)}" if late else "costs least"
        return (
            f"Of {tries} the one at {time_words(best.departure_s)} {least}; it arrives at {time_words(best.arrival_s)}."
        )
    if late:
        soonest = time_words(min(late))
        return f"At none of {tries} does a path arrive by {time_words(arrive_by_s)}; the soonest arrives at {soonest}."
    return f"At none of {tries} was a path found: {tried[-1].why}"
