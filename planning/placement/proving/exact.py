"""Small instances solved exactly, by going through all sets."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from planning.placement.judges import Judge
from planning.placement.together import Together

__all__ = ["ExactAnswer", "every_set", "number_of_sets"]


@dataclass(frozen=True, slots=True)
class ExactAnswer:
    """The best of all sets, and its value."""

    chosen: list[int]
    value: float


def every_set(
    judge: Judge, candidates: int, count: int, together: Together, stop: Callable[[], bool] | None = None
) -> ExactAnswer | None:
    """The best of all allowed sets, by going through them; None where none is allowed or ``stop`` said so."""
    best: tuple[float, list[int]] | None = None
    for prefix in combinations(range(candidates), count - 1):
        if stop is not None and stop():
            return None
        members = list(prefix)
        which = np.flatnonzero(together.may_join(members))
        which = which[which > (members[-1] if members else -1)]
        if not len(which) or (not together.free and not _may_be_allowed(members, together)):
            continue
        values = judge.with_each(members, which)
        for at in np.argsort(-values, kind="stable"):
            if best is not None and values[at] <= best[0]:
                break
            whole = [*members, int(which[at])]
            if together.free or together.allows(whole):
                best = (float(values[at]), whole)
                break
    return None if best is None else ExactAnswer(best[1], best[0])


def _may_be_allowed(members: list[int], together: Together) -> bool:
    """Whether no two members are too near each other."""
    return not together.separated or all(
        bool(together.may_join(members[:at])[member]) for at, member in enumerate(members)
    )


def number_of_sets(candidates: int, count: int) -> int:
    """How many sets there are."""
    return math.comb(candidates, count)
