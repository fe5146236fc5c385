"""Parity by QR over epochs of linearised measurements: whether they agree, and which do not.

Qᵀ·[A | I] by Householder's reflections gives R, and Qᵀ whose lower rows span the parity space. With S = q_pᵀ·q_p and
r = S·z the statistic |p|² loses r_Fᵀ·S_FF⁻¹·r_F when the measurements F are left out, whatever their number, so that a
search over sets solves systems as small as the sets. S_FF⁻¹·r_F is also by how much each of them is wrong.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel

__all__ = [
    "AMBIGUOUS",
    "CLEAR",
    "DEGREES",
    "EXCLUDED",
    "EXPLAINED",
    "KEPT",
    "LEFT_OUT",
    "REMAINING",
    "STATISTIC",
    "SUSPECTED",
    "TAKEN_OUT",
    "UNEXPLAINED",
    "UNTESTABLE",
    "WORST",
    "Limits",
    "judge_epochs",
]

# what is found of an epoch
UNTESTABLE, CLEAR, EXPLAINED, AMBIGUOUS, UNEXPLAINED = 0, 1, 2, 3, 4
# what becomes of a measurement
LEFT_OUT, KEPT, TAKEN_OUT, SUSPECTED = 0, 1, 2, 3
# columns of what is found
STATISTIC, DEGREES, WORST, REMAINING, EXCLUDED = 0, 1, 2, 3, 4

# of the largest pivot; directions that are weaker than this are none
RANK = 1e-9
# of a measurement's own variance: what is left of it in parity space when others are left out. Less cannot be told.
SEEN = 1e-9


class Limits(NamedTuple):
    """elements_sigma: of each parity element (eq. 2.12), 0 = the chi-square test; most_excluded: the largest set."""

    elements_sigma: float
    most_excluded: int


@scalar_kernel
def _reflect(rows, turned):
    """Fill turned (k, n + k) with Qᵀ·[A | I] of rows (k, n); whether A has full rank."""
    k, n = rows.shape
    width = n + k
    turned[:] = 0.0
    largest = 0.0
    for i in range(k):
        for j in range(n):
            turned[i, j] = rows[i, j]
        turned[i, n + i] = 1.0
    axis = np.empty(k)
    for j in range(n):
        square = 0.0
        for i in range(j, k):
            axis[i] = turned[i, j]
            square += axis[i] * axis[i]
        length = math.sqrt(square)
        largest = max(largest, length)
        if not length > RANK * largest:
            return False
        axis[j] += math.copysign(length, axis[j])
        square = 0.0
        for i in range(j, k):
            square += axis[i] * axis[i]
        for c in range(j, width):
            along = 0.0
            for i in range(j, k):
                along += axis[i] * turned[i, c]
            along *= 2.0 / square
            for i in range(j, k):
                turned[i, c] -= along * axis[i]
    return True


@scalar_kernel
def _explained(chosen, seen, residual, sizes):
    """What leaving out the set takes from the statistic; fill sizes (f,) with by how much each is wrong; -1 = cannot.

    chosen: (f,) numbers; seen: S (k, k); residual: S·z (k,). Cholesky's root of S_FF.
    """
    f = chosen.shape[0]
    root = np.empty((f, f))
    gain = 0.0
    for i in range(f):
        for j in range(i + 1):
            value = seen[chosen[i], chosen[j]]
            for c in range(j):
                value -= root[i, c] * root[j, c]
            if i == j:
                if not value > SEEN:
                    return -1.0
                root[i, i] = math.sqrt(value)
            else:
                root[i, j] = value / root[j, j]
        value = residual[chosen[i]]
        for c in range(i):
            value -= root[i, c] * sizes[c]
        sizes[i] = value / root[i, i]
        gain += sizes[i] * sizes[i]
    for i in range(f - 1, -1, -1):
        for c in range(i + 1, f):
            sizes[i] -= root[c, i] * sizes[c]
        sizes[i] /= root[i, i]
    return gain


@scalar_kernel
def _next(chosen, k):
    """Go to the next set of as many of k in order; whether there is one."""
    f = chosen.shape[0]
    i = f - 1
    while i >= 0 and chosen[i] == k - f + i:
        i -= 1
    if i < 0:
        return False
    chosen[i] += 1
    for c in range(i + 1, f):
        chosen[c] = chosen[c - 1] + 1
    return True


@scalar_kernel
def _search(f, seen, residual, most, marks):
    """(gain, sets that explain) of the best set of f: one that explains as much as ``most``; marks all in such sets."""
    k = residual.shape[0]
    chosen, best = np.arange(f), np.zeros(f, np.int64)
    sizes = np.empty(f)
    best_gain, explaining = -1.0, 0
    marks[:] = KEPT
    while True:
        gain = _explained(chosen, seen, residual, sizes)
        if gain >= most:
            explaining += 1
            for c in range(f):
                marks[chosen[c]] = SUSPECTED
        if gain > best_gain:
            best_gain = gain
            best[:] = chosen
        if not _next(chosen, k):
            break
    return best_gain, explaining, best


@scalar_kernel
def _judge(rows, scaled, sigmas, critical, limits, found, marks, out):
    """Judge k usable measurements; found (COLUMNS,), marks (k,), out: (solution (n,), wrong by (k,)); the verdict."""
    k, n = rows.shape
    solution, wrong_by = out
    turned = np.empty((k, n + k))
    if limits.elements_sigma > 0.0:
        # as printed: Q of the geometry alone, and each element against its own sigma
        plain, measured = rows.copy(), scaled.copy()
        for i in range(k):
            measured[i] *= sigmas[i]
            for j in range(n):
                plain[i, j] *= sigmas[i]
        if not _reflect(plain, turned):
            return UNTESTABLE
        worst = 0.0
        for i in range(n, k):
            element, variance = 0.0, 0.0
            for j in range(k):
                element += turned[i, n + j] * measured[j]
                variance += (turned[i, n + j] * sigmas[j]) ** 2
            worst = max(worst, abs(element) / math.sqrt(variance))
        found[WORST] = worst
    if not _reflect(rows, turned):
        return UNTESTABLE
    statistic = 0.0
    seen, residual = np.zeros((k, k)), np.zeros(k)
    for i in range(n, k):
        element = 0.0
        for j in range(k):
            element += turned[i, n + j] * scaled[j]
        statistic += element * element
        for j in range(k):
            residual[j] += turned[i, n + j] * element
    found[STATISTIC], found[REMAINING], found[DEGREES] = statistic, statistic, k - n
    verdict = UNTESTABLE
    if k > n:
        alarm = found[WORST] > limits.elements_sigma if limits.elements_sigma > 0.0 else statistic > critical[k - n]
        verdict = CLEAR
        if alarm:
            verdict = UNEXPLAINED
            for i in range(n, k):
                for a in range(k):
                    for b in range(k):
                        seen[a, b] += turned[i, n + a] * turned[i, n + b]
            for f in range(1, min(limits.most_excluded, k - n - 1) + 1):
                gain, explaining, best = _search(f, seen, residual, statistic - critical[k - n - f], marks)
                if explaining > 0:
                    verdict = EXPLAINED if explaining == 1 else AMBIGUOUS
                    sizes = np.empty(f)
                    _explained(best, seen, residual, sizes)
                    for c in range(f):
                        marks[best[c]] = TAKEN_OUT
                        wrong_by[best[c]] = sizes[c] * sigmas[best[c]]
                        scaled[best[c]] -= sizes[c]
                    found[REMAINING], found[EXCLUDED] = statistic - gain, f
                    break
    # R·x = q_uᵀ·z, from the last on
    for i in range(n - 1, -1, -1):
        value = 0.0
        for j in range(k):
            value += turned[i, n + j] * scaled[j]
        for j in range(i + 1, n):
            value -= turned[i, j] * solution[j]
        solution[i] = value / turned[i, i]
    return verdict


@parallel_kernel
def judge_epochs(rows, measured, sigmas, critical, limits, found, marks, out):
    """Judge e epochs of m measurements z = A·x + noise each.

    rows: A (e, m, n); measured: (e, m), NaN = none; sigmas: (e, m), inf = left out. critical: (m + 1,) the statistic's
    limit by degrees of freedom. found: (e, 5) columns as above; marks: (e, m) uint8. out: (solutions (e, n), wrong by
    (e, m) in the measurement's unit, verdicts (e,) uint8); solutions stay as they are where there is none.
    """
    solutions, wrong_by, verdicts = out
    n = rows.shape[2]
    for e in prange(rows.shape[0]):
        usable = np.empty(rows.shape[1], np.int64)
        k = 0
        for i in range(rows.shape[1]):
            marks[e, i] = LEFT_OUT
            if sigmas[e, i] < math.inf and not math.isnan(measured[e, i]):
                usable[k] = i
                k += 1
        verdicts[e] = UNTESTABLE
        if k < n:
            continue
        mine, scaled, own_sigmas = np.empty((k, n)), np.empty(k), np.empty(k)
        own_marks, wrong = np.full(k, KEPT, np.uint8), np.zeros(k)
        for i in range(k):
            own_sigmas[i] = sigmas[e, usable[i]]
            scaled[i] = measured[e, usable[i]] / own_sigmas[i]
            for j in range(n):
                mine[i, j] = rows[e, usable[i], j] / own_sigmas[i]
        solution = np.full(n, math.nan)
        results = solution, wrong
        verdicts[e] = _judge(mine, scaled, own_sigmas, critical, limits, found[e], own_marks, results)
        solutions[e] = solution
        for i in range(k):
            marks[e, usable[i]] = own_marks[i]
            wrong_by[e, usable[i]] = wrong[i]
