"""The fewest anchors that reach a share."""

from __future__ import annotations

import math
from collections.abc import Callable

from planning.errors import PlacementError

from .greedy import bound_of, fill_up, greedy
from .judges import CountJudge, Problem, judge_of
from .searching import ROUNDING, Found, SearchOptions, search
from .together import Together

__all__ = ["MOST_ANCHORS", "fewest"]

MOST_ANCHORS = 64


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
