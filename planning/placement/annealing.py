"""Ways from a set to better ones: a heat bath over all exchanges, and the sets between two good ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .judges import Judge
from .together import Together

__all__ = ["annealed", "between"]

# heat at first and at last, as parts of the spread of what an anchor may be exchanged for
FIRST_HEAT, LAST_HEAT = 0.2, 0.002
LEAST_GAIN = 1e-12


def annealed(
    judge: Judge,
    chosen: list[int],
    together: Together,
    random: np.random.Generator,
    steps: int,
    stop: Callable[[], bool] | None = None,
) -> list[int]:
    """The best set met on a walk from ``chosen``, each step of which exchanges one anchor.

    The newcomer is drawn among all candidates by what each makes of the set, as in a heat bath: at first nearly any,
    at last the best. Unlike annealing by single trials no step is refused, and one call judges all candidates.
    """
    current, best, best_value = list(chosen), list(chosen), judge.value(chosen)
    heat, cooling = 0.0, (LAST_HEAT / FIRST_HEAT) ** (1.0 / max(steps, 1))
    for _ in range(steps if chosen else 0):
        if stop is not None and stop():
            break
        slot = int(random.integers(len(current)))
        rest = current[:slot] + current[slot + 1 :]
        which = np.flatnonzero(together.may_join(rest))
        if not len(which):
            continue
        values = judge.with_each(rest, which)
        heat = heat or FIRST_HEAT * float(values.max() - np.median(values))
        at = int(np.argmax(values + heat * random.gumbel(size=len(which))))
        current[slot] = int(which[at])
        if values[at] > best_value + LEAST_GAIN:
            best, best_value = list(current), float(values[at])
        heat *= cooling
    return best


def between(judge: Judge, one: list[int], other: list[int], together: Together) -> list[int] | None:
    """The best set on the way from one to another of the same size, ends excluded; None where nothing lies between.

    Each step takes the exchange that is best among those that lead towards the other set.
    """
    current, best, best_value = list(one), None, -np.inf
    missing = [member for member in other if member not in one]
    while len(missing) > 1:
        step: tuple[float, int, int] | None = None
        for at, member in enumerate(current):
            if member in other:
                continue
            rest = current[:at] + current[at + 1 :]
            which = np.array(missing, np.intp)[together.may_join(rest)[missing]]
            if len(which):
                values = judge.with_each(rest, which)
                top = int(np.argmax(values))
                if step is None or values[top] > step[0]:
                    step = (float(values[top]), at, int(which[top]))
        if step is None:
            break
        current[step[1]] = step[2]
        missing.remove(step[2])
        if step[0] > best_value:
            best, best_value = list(current), step[0]
    return best
