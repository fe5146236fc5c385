"""Small instances solved exactly: coverage by HiGHS, any goal by going through all sets."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from .judges import Judge, Problem
from .together import Together

__all__ = ["ExactAnswer", "every_set", "exact_coverage", "sets_of_targets"]

MOST_SIGNATURES = 4_000
MOST_CANDIDATES = 60
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ExactAnswer:
    """A set, the value that no set exceeds, and whether the set is proved to be best."""

    chosen: list[int]
    bound: float
    proved: bool


def sets_of_targets(problem: Problem) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.int64], Floats]:
    """Targets that see the same anchors as one: (which candidates (g, n), fixed anchors in sight (g,), weight (g,))."""
    seen = problem.sight.visible()
    fixed = problem.fixed_sight.visible().sum(axis=0).astype(np.int64)
    packed = np.packbits(seen, axis=0)
    keys = np.ascontiguousarray(np.vstack([packed, fixed.astype(np.uint8)[None, :]]).T)
    _, first, group = np.unique(
        keys.view([("", np.uint8)] * keys.shape[1]).ravel(), return_index=True, return_inverse=True
    )
    weight: Floats = np.bincount(group.ravel(), problem.targets.weight, minlength=len(first)).astype(np.float64)
    return seen[:, first].T, fixed[first], weight


def exact_coverage(problem: Problem, count: int, together: Together, time_limit_s: float) -> ExactAnswer | None:
    """The set with the largest share of targets that have enough in sight, by HiGHS; None where it is not small.

    Maximise the weight of y_g over x_c in {0, 1}, Σ x = count, needed · y_g ≤ fixed_g + Σ of the x_c that g sees; two
    candidates too near each other exclude one another.
    """
    candidates = len(problem.anchor)
    if candidates > MOST_CANDIDATES:
        return None
    needed = problem.goal.needed_with_spare
    sees, fixed, weight = sets_of_targets(problem)
    covered = fixed >= needed
    useful = ~covered & (fixed + sees.sum(axis=1) >= needed)
    already = float(weight[covered].sum())
    if np.count_nonzero(useful) > MOST_SIGNATURES:
        return None
    sees, fixed, weight = sees[useful], fixed[useful], weight[useful]
    total = problem.targets.total
    found = _solve(sees, needed - fixed, weight / total, count, together, time_limit_s)
    if found is None:
        return None
    chosen, share = found
    return ExactAnswer(chosen, already / total + share, True)


def _solve(
    sees: npt.NDArray[np.bool_],
    missing: npt.NDArray[np.int64],
    weight: Floats,
    count: int,
    together: Together,
    time_limit_s: float,
) -> tuple[list[int], float] | None:
    from scipy.optimize import Bounds, LinearConstraint, milp
    from scipy.sparse import coo_array, csr_array, hstack, vstack

    groups, candidates = sees.shape
    # x first, then y
    enough = hstack([csr_array(sees.astype(np.float64)), csr_array(np.diag(-missing.astype(np.float64)))])
    number = coo_array(np.concatenate([np.ones(candidates), np.zeros(groups)])[None, :])
    rows = [enough, number]
    low, high = [np.zeros(groups), np.array([count])], [np.full(groups, np.inf), np.array([count])]
    pairs = together.conflicts() if together.separated else np.zeros((0, 2), np.intp)
    if len(pairs):
        at = np.repeat(np.arange(len(pairs)), 2)
        rows.append(coo_array((np.ones(at.size), (at, pairs.ravel())), shape=(len(pairs), candidates + groups)))
        low.append(np.full(len(pairs), -np.inf))
        high.append(np.ones(len(pairs)))
    answer = milp(
        np.concatenate([np.zeros(candidates), -weight]),
        integrality=np.ones(candidates + groups),
        bounds=Bounds(0.0, np.concatenate([_upper(together), np.ones(groups)])),
        constraints=LinearConstraint(vstack(rows), np.concatenate(low), np.concatenate(high)),
        options={"time_limit": time_limit_s, "mip_rel_gap": 0.0},
    )
    if answer.status != 0:
        return None
    return [int(n) for n in np.flatnonzero(answer.x[:candidates] > 0.5)], float(-answer.fun)


def _upper(together: Together) -> Floats:
    """1 for each candidate that a set may hold at all."""
    return together.may_join([]).astype(np.float64)


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
    return None if best is None else ExactAnswer(best[1], best[0], True)


def _may_be_allowed(members: list[int], together: Together) -> bool:
    """Whether no two members are too near each other."""
    return not together.separated or all(
        bool(together.may_join(members[:at])[member]) for at, member in enumerate(members)
    )


def number_of_sets(candidates: int, count: int) -> int:
    """How many sets there are."""
    return math.comb(candidates, count)
