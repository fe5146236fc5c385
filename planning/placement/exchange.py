"""Local search: one anchor of a set is exchanged for a better candidate until none is better."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from .judges import Judge
from .together import Together

__all__ = ["exchange", "fill_up"]

# a gain below this is rounding, and would let the search run in circles
LEAST_GAIN = 1e-12


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


def fill_up(judge: Judge, chosen: list[int], count: int, together: Together) -> list[int]:
    """The set with the best allowed candidates added one after the other until it has ``count``, or none is allowed."""
    best = list(chosen)
    while len(best) < count:
        which = np.flatnonzero(together.may_join(best))
        if not len(which):
            break
        best.append(int(which[np.argmax(judge.with_each(best, which))]))
    return best
