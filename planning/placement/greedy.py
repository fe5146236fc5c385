"""Placements one anchor after the other: greedy, bounds of what no choice exceeds, exchanges that better it."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from .goals import Goal
from .judges import CountJudge, GeometryJudge, Judge, Problem
from .together import Together

__all__ = ["bound_of", "exchange", "fill_up", "greedy", "roomy", "upper_bound"]

# candidates evaluated again at once: a kernel call costs as much as a few of them
AT_ONCE = 16
# a gain below this is rounding, and would let the search run in circles
LEAST_GAIN = 1e-12
# so many candidates are tried for the room that they leave others
MOST_LOOKED_AT = 64


def greedy(
    judge: Judge, candidates: int, count: int, together: Together, stop: Callable[[], bool] | None = None
) -> list[int]:
    """At most ``count`` candidates, each the best to add to those before it; fewer where no more are allowed.

    ``judge`` must be submodular. Ties go to the lower number.
    """
    chosen: list[int] = []
    value = judge.value(chosen)
    gains = judge.with_each(chosen, np.arange(candidates)) - value
    fresh_at = np.zeros(candidates, np.int64)
    queue = [(-gain, number) for number, gain in enumerate(gains.tolist())]
    heapq.heapify(queue)
    while len(chosen) < count and not (stop is not None and stop()):
        allowed = together.may_join(chosen)
        found = _next(queue, judge, chosen, value, fresh_at, allowed)
        if found is None:
            break
        gain, number = found
        chosen.append(number)
        value += gain
    return chosen


def _next(
    queue: list[tuple[float, int]],
    judge: Judge,
    chosen: list[int],
    value: float,
    fresh_at: npt.NDArray[np.int64],
    allowed: npt.NDArray[np.bool_],
) -> tuple[float, int] | None:
    """(gain, number) of the best allowed candidate, taken off the queue; those not allowed now stay for later."""
    put_back: list[tuple[float, int]] = []
    found = None
    while queue and found is None:
        stale: list[int] = []
        while queue and len(stale) < AT_ONCE:
            entry = heapq.heappop(queue)
            number = entry[1]
            if not allowed[number]:
                put_back.append(entry)
            elif fresh_at[number] == len(chosen):
                if not stale:
                    found = (-entry[0], number)
                    break
                heapq.heappush(queue, entry)
                break
            else:
                stale.append(number)
        if stale:
            which = np.array(stale, np.intp)
            fresh = judge.with_each(chosen, which) - value
            fresh_at[which] = len(chosen)
            for number, gain in zip(stale, fresh.tolist(), strict=True):
                heapq.heappush(queue, (-gain, number))
    for entry in put_back:
        heapq.heappush(queue, entry)
    return found


def upper_bound(judge: Judge, candidates: int, count: int, chosen: list[int], so_far: int = 0) -> float:
    """No set of ``count`` candidates has a larger value of this submodular judge; tightest over the prefixes of a set.

    For any set S, the best is at most value(S) plus the largest ``count`` gains on top of S.
    """
    everyone = np.arange(candidates)
    best = np.inf
    for size in range(so_far, len(chosen) + 1):
        value = judge.value(chosen[:size])
        gains = np.sort(judge.with_each(chosen[:size], everyone) - value)[::-1]
        best = min(best, value + float(gains[:count].sum()))
    return float(best)


def bound_of(problem: Problem, count: int) -> float:
    """A value that no set of so many candidates exceeds, whatever rules hold between them.

    A target that counts sees at least as many anchors as the goal needs, so the share of such targets is at most the
    mean of min(in sight, needed) / needed, which is submodular. Targets for which even all candidates together do not
    suffice count for neither. Errors are bounded by what all candidates together would give, and by what the best
    geometry of so many ranges gives.
    """
    goal = problem.goal
    possible = _possible(problem)
    if goal.is_share:
        needed = goal.needed_with_spare
        judge = CountJudge(problem, needed, partial=True, possible=possible)
        anyone = Together.anything_goes(len(problem.anchor))
        members = greedy(judge, len(problem.anchor), count, anyone)
        most = float(problem.targets.weight[possible].sum()) / problem.targets.total
        return min(upper_bound(judge, len(problem.anchor), count, members), most)
    return -_least_error(problem, count)


def _possible(problem: Problem) -> np.ndarray:
    """(m,) bool: targets that would count if every candidate stood."""
    goal, sight = problem.goal, problem.sight.visible().sum(axis=0) + problem.fixed_sight.visible().sum(axis=0)
    enough = sight >= goal.needed_with_spare
    if goal.objective != "dop":
        return np.asarray(enough)
    best = GeometryJudge(_without_spare(problem)).of_targets(list(range(len(problem.anchor))))
    return np.asarray(enough & (best > 0.5))


def _without_spare(problem: Problem) -> Problem:

    return replace(problem, goal=replace(problem.goal, spare=0))


def _least_error(problem: Problem, count: int) -> float:
    """Metres that no set gets below, mean or worst as the goal says, as its judge joins them."""
    goal = problem.goal
    error_m = -GeometryJudge(_without_spare(problem)).of_targets(list(range(len(problem.anchor))))
    ranges = count + len(problem.fixed) - goal.spare
    weight = float(max(problem.anchor[:, 3].max(), problem.fixed[:, 3].max(initial=0.0)))
    error_m = np.minimum(
        np.maximum(error_m, _best_geometry(goal) / math.sqrt(weight * max(ranges, 1))), goal.worst_counted_m
    )
    mean_m = float((error_m * problem.targets.weight).sum()) / problem.targets.total
    return mean_m if goal.objective == "mean_error" else float(error_m.max())


def _best_geometry(goal: Goal) -> float:
    """sqrt(n) times the least dilution of n ranges: n unknowns in an isotropic information of trace n."""
    if goal.on_surface:
        return 2.0
    return {"hdop": 2.0, "vdop": 1.0}.get(goal.measure, 3.0)


def exchange(
    judge: Judge,
    chosen: list[int],
    together: Together,
    *,
    shortlist: npt.NDArray[np.intp] | None = None,
    stop: Callable[[], bool] | None = None,
) -> list[int]:
    """A set in which no exchange of one anchor is better (among the ``shortlist``, all candidates by default).

    Each anchor in turn is taken out and the best allowed candidate put in its place; ends after a whole round without
    a gain, or when ``stop`` says so.
    """
    best = list(chosen)
    value = judge.value(best)
    slot, idle = 0, 0
    while best and idle < len(best) and not (stop is not None and stop()):
        rest = best[:slot] + best[slot + 1 :]
        which = np.flatnonzero(together.may_join(rest))
        if shortlist is not None:
            which = np.intersect1d(which, shortlist)
        idle += 1
        if len(which):
            values = judge.with_each(rest, which)
            winner = int(np.argmax(values))
            if values[winner] > value + LEAST_GAIN:
                best = [*best[:slot], int(which[winner]), *best[slot + 1 :]]
                # not the kernel's own sum, which may round otherwise than value() does
                value = judge.value(best)
                idle = 1
        slot = (slot + 1) % len(best)
    return best


def roomy(count: int, together: Together, random: np.random.Generator) -> list[int]:
    """Up to ``count`` candidates, each of those that leave most others room; of many allowed some are looked at."""
    chosen: list[int] = []
    while len(chosen) < count:
        allowed = random.permutation(np.flatnonzero(together.may_join(chosen)))[:MOST_LOOKED_AT].tolist()
        if not allowed:
            break
        room = [int(together.may_join([*chosen, member]).sum()) for member in allowed]
        chosen.append(allowed[int(np.argmax(room))])
    return chosen


def fill_up(judge: Judge, chosen: list[int], count: int, together: Together) -> list[int]:
    """The set with the best allowed candidates added one after the other until it has ``count``, or none is allowed."""
    best = list(chosen)
    while len(best) < count:
        which = np.flatnonzero(together.may_join(best))
        if not len(which):
            break
        best.append(int(which[np.argmax(judge.with_each(best, which))]))
    return best
