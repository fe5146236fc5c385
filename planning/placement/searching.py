"""The search for a set: greedy, local search from several starts, exact where it is small."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from planning.errors import PlacementError

from .exact import ExactAnswer, every_set, exact_coverage, number_of_sets
from .greedy import bound_of, exchange, fill_up, greedy
from .judges import CountJudge, GeometryJudge, Judge, Problem, judge_of, sampled
from .together import Together

__all__ = ["MOST_ANCHORS", "Found", "SearchOptions", "fewest", "search"]

MOST_SETS = 6_000
MOST_EVALUATIONS = 60_000_000  # sets × targets that are worth going through
SHORTLIST = 48
MOST_ANCHORS = 64
ROUNDING = 1e-12


@dataclass(frozen=True, slots=True)
class SearchOptions:
    """How hard to search.

    seed: of the random restarts; the same seed gives the same answer. restarts: how often the best set is shaken.
    sample: so many targets at most judge exchanges; the answer is judged by all. exact: whether small instances are
    solved exactly. time_limit_s: of HiGHS.
    """

    seed: int = 0
    restarts: int = 4
    sample: int = 12_000
    exact: bool = True
    time_limit_s: float = 20.0


@dataclass(frozen=True, slots=True)
class Found:
    """A set, its value, what no set exceeds, how it was found, and whether the search was stopped before its end.

    greedy: the set that greedy alone reached.
    """

    chosen: list[int]
    value: float
    bound: float
    method: str
    proved: bool
    stopped: bool
    greedy: list[int]


def search(
    problem: Problem,
    count: int,
    together: Together,
    options: SearchOptions,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> Found:
    """The best set of ``count`` candidates that was found; fewer where the rules between them allow no more."""
    judge = judge_of(problem)
    # also when the search is to stop at once: something has to come of it
    first = greedy(_guides(problem)[0], len(problem.anchor), count, together)
    if not (stop is not None and stop()):
        first = fill_up(judge, first, count, together)
    first_value = judge.value(first)
    exact = _exact(problem, judge, count, together, options, stop) if options.exact else None
    if exact is not None and exact.proved:
        chosen, bound = exact.chosen, exact.bound
        return Found(chosen, judge.value(chosen), bound, "exact", True, False, first)
    best, value = first, first_value
    sample = _sampled(problem, options.sample)
    for candidate in _local_optima(problem, sample, count, together, options, progress, stop):
        found = judge.value(candidate)
        if len(candidate) >= len(best) and found > value:
            best, value = candidate, found
    if sample is not problem and not _stopped(stop):
        best = exchange(judge, best, together, shortlist=_shortlist(sample, best, together), stop=stop)
        value = judge.value(best)
    bound = max(bound_of(problem, count), value)
    return Found(best, value, bound, "local search", bound <= value + 1e-9, _stopped(stop), first)


def _stopped(stop: Callable[[], bool] | None) -> bool:
    return stop is not None and stop()


def _exact(
    problem: Problem,
    judge: Judge,
    count: int,
    together: Together,
    options: SearchOptions,
    stop: Callable[[], bool] | None,
) -> ExactAnswer | None:
    candidates = len(problem.anchor)
    sets = number_of_sets(candidates, count)
    if sets <= MOST_SETS and sets * len(problem.targets) <= MOST_EVALUATIONS:
        return every_set(judge, candidates, count, together, stop)
    if problem.goal.objective == "coverage" and not together.relayed:
        return exact_coverage(problem, count, together, options.time_limit_s)
    return None


def _guides(problem: Problem) -> list[Judge]:
    """Submodular judges for greedy: they reward the first anchors over a target too, which the goal itself may not."""
    counting = CountJudge(problem, problem.goal.needed_with_spare, partial=True)
    if problem.goal.objective == "coverage":
        return [counting]
    return [counting, GeometryJudge(problem, information=True)]


def _local_optima(
    problem: Problem,
    sample: Problem,
    count: int,
    together: Together,
    options: SearchOptions,
    progress: Callable[[float], None] | None,
    stop: Callable[[], bool] | None,
) -> Iterator[list[int]]:
    """Sets that no exchange betters: from greedy, from places far apart, from high ones, and from the best shaken."""
    judge, candidates = judge_of(sample), len(problem.anchor)
    random = np.random.default_rng(options.seed)
    starts: list[Callable[[], list[int]]] = [
        partial(greedy, guide, candidates, count, together, stop) for guide in _guides(sample)
    ]
    starts += [lambda: _far_apart(problem, count, together), lambda: _highest(problem, count, together)]
    rounds = len(starts) + options.restarts
    best: list[int] = []
    for number in range(rounds):
        if _stopped(stop):
            return
        start = starts[number]() if number < len(starts) else _shaken(best, random)
        found = exchange(judge, fill_up(judge, start, count, together), together, stop=stop)
        if not best or (len(found) >= len(best) and judge.value(found) > judge.value(best)):
            best = found
        yield found
        if progress is not None:
            progress((number + 1) / rounds)


def _far_apart(problem: Problem, count: int, together: Together) -> list[int]:
    """Places each as far as can be from those before it, beginning in the middle."""
    position_m = problem.anchor[:, :3]
    middle_m = problem.targets.point_m.mean(axis=0)
    away_m = ((position_m[:, :2] - middle_m[:2]) ** 2).sum(axis=1)
    chosen: list[int] = []
    nearest_m2 = -away_m
    while len(chosen) < count:
        allowed = np.flatnonzero(together.may_join(chosen))
        if not len(allowed):
            break
        chosen.append(int(allowed[np.argmax(nearest_m2[allowed])]))
        apart_m2 = ((position_m - position_m[chosen[-1]]) ** 2).sum(axis=1)
        nearest_m2 = apart_m2 if len(chosen) == 1 else np.minimum(nearest_m2, apart_m2)
    return chosen


def _highest(problem: Problem, count: int, together: Together) -> list[int]:
    """The highest places."""
    chosen: list[int] = []
    for number in np.argsort(-problem.anchor[:, 2], kind="stable"):
        if len(chosen) == count:
            break
        if together.may_join(chosen)[number]:
            chosen.append(int(number))
    return chosen


def _shaken(chosen: list[int], random: np.random.Generator) -> list[int]:
    """The set without two of its members, or one of two."""
    leave_out = random.choice(len(chosen), size=min(2, len(chosen) - 1), replace=False).tolist()
    return [member for at, member in enumerate(chosen) if at not in leave_out]


def _sampled(problem: Problem, most: int) -> Problem:
    """The problem with evenly spread targets, or itself where it has few."""
    targets = len(problem.targets)
    if problem.goal.objective == "coverage" or targets <= most:
        return problem
    # a step that shares no factor with a row of posts leaves no stripes; a shuffled order leaves none at all
    order = np.random.default_rng(20_260_501).permutation(targets)[:most]
    return sampled(problem, np.sort(order))


def _shortlist(sample: Problem, chosen: list[int], together: Together) -> npt.NDArray[np.intp]:
    """The candidates that promise most in place of each member, by the sample."""
    judge = judge_of(sample)
    promising: list[npt.NDArray[np.intp]] = []
    for at in range(len(chosen)):
        rest = chosen[:at] + chosen[at + 1 :]
        which = np.flatnonzero(together.may_join(rest))
        order = np.argsort(-judge.with_each(rest, which), kind="stable")[: max(SHORTLIST // len(chosen), 4)]
        promising.append(which[order])
    return np.unique(np.concatenate([*promising, np.array(chosen, np.intp)]))


def fewest(
    problem: Problem,
    share: float,
    together: Together,
    options: SearchOptions,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> tuple[Found, int]:
    """(the smallest set found that reaches a share 0..1, a number of anchors below which none can).

    Greedy tells how many certainly do; from there the search tries one fewer until it fails. Raises PlacementError
    where not even all candidates, or as many as the rules between them allow, reach it.
    """
    judge, candidates = judge_of(problem), len(problem.anchor)
    most = judge.value(list(range(candidates)))
    if most < share - ROUNDING:
        raise PlacementError(
            f"A share of {share:.1%} cannot be reached: all {candidates:,} candidates together reach {most:.1%}."
        )
    few, enough = greedy_prefix(problem, share, together, stop)
    if not enough and not (stop is not None and stop()):
        raise PlacementError(
            f"A share of {share:.1%} was not reached with {len(few)} anchors, the most that were tried or that the "
            f"rules between anchors allow; they reach {judge.value(few):.1%}."
        )
    needed = _needed(problem, share, len(few))
    value = judge.value(few)
    best = Found(few, value, value, "greedy", False, stop is not None and stop(), few)
    for count in range(len(few) - (1 if enough else 0), needed - 1, -1):
        if stop is not None and stop():
            break
        found = search(problem, count, together, options, progress, stop)
        if found.value < share - ROUNDING:
            break
        best = found
    return best, needed


def greedy_prefix(
    problem: Problem, share: float, together: Together, stop: Callable[[], bool] | None
) -> tuple[list[int], bool]:
    """(what greedy places until a share is reached, whether it is)."""
    judge, candidates = judge_of(problem), len(problem.anchor)
    guide = CountJudge(problem, problem.goal.needed_with_spare, partial=True)
    chosen = greedy(guide, candidates, min(MOST_ANCHORS, candidates), together, stop)
    for size in range(1, len(chosen) + 1):
        if judge.value(chosen[:size]) >= share - ROUNDING:
            return chosen[:size], True
    while len(chosen) < min(MOST_ANCHORS, candidates):
        grown = fill_up(judge, chosen, len(chosen) + 1, together)
        if len(grown) == len(chosen):
            break
        chosen = grown
        if judge.value(chosen) >= share - ROUNDING:
            return chosen, True
    return chosen, False


def _needed(problem: Problem, share: float, at_most: int) -> int:
    """The smallest number of anchors whose bound is not below the share."""
    low, high = 1, at_most
    while low < high:
        middle = math.floor((low + high) / 2)
        if bound_of(problem, middle) >= share - ROUNDING:
            high = middle
        else:
            low = middle + 1
    return low
