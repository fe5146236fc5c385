"""Greedy choice with lazy evaluation, and the bounds that its gains prove about every other choice.

Where a value is submodular an anchor's gain only shrinks as the set grows, so an old gain is an upper bound: only
candidates whose old gain is still the largest are evaluated again (Minoux). The set is then within 1 − 1/e of the best
(Nemhauser, Wolsey, Fisher), as long as any set is allowed.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from .judges import Judge
from .together import Together

__all__ = ["greedy", "upper_bound"]

# candidates evaluated again at once: a kernel call costs as much as a few of them
AT_ONCE = 16


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
