"""Protection levels by separation of solutions: how far off a position may be though nothing was noticed.

Every set F of measurements that may be wrong together is a hypothesis of probability p_F. Without F the position has
covariance C_F; it differs from that of all measurements by a normal error of covariance C_F - C_0, so that an alarm at
K of those sigmas bounds what F can do unnoticed. The level L of an axis is where
2·Q(L/σ_0)·p_0 + Σ p_F·Q((L - K·σ_ss,F)/σ_F) meets the risk that is allowed (Blanch et al., Baseline ARAIM, 2015).
"""

import math

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel

__all__ = ["ALARM", "MOST", "RISK", "UNWATCHED", "protection_levels"]

EAST, NORTH, UP = 0, 1, 2
# places of what is asked for
RISK, ALARM, UNWATCHED, MOST = 0, 1, 2, 3
# the hypothesis that nothing is wrong
WELL = 0
FARTHEST_M = 1e7
WEAK = 1e-12


@scalar_kernel
def _tail(x):
    return 0.5 * math.erfc(x / math.sqrt(2.0))


@scalar_kernel
def _sigma_of_tail(probability):
    """How many sigmas a normal number passes on one side with that probability."""
    low, high = -40.0, 40.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        if _tail(middle) > probability:
            low = middle
        else:
            high = middle
    return high


@scalar_kernel
def _variances(information, out):
    """Fill out (3,) with the first three variances of the inverse of (n, n); whether there is one."""
    n = information.shape[0]
    root = np.zeros((n, n))
    for j in range(n):
        value = information[j, j]
        for c in range(j):
            value -= root[j, c] * root[j, c]
        if not value > WEAK * information[j, j]:
            return False
        root[j, j] = math.sqrt(value)
        for i in range(j + 1, n):
            value = information[i, j]
            for c in range(j):
                value -= root[i, c] * root[j, c]
            root[i, j] = value / root[j, j]
    column = np.empty(n)
    for axis in range(3):
        total = 0.0
        for i in range(n):
            value = 1.0 if i == axis else 0.0
            for c in range(axis, i):
                value -= root[i, c] * column[c]
            column[i] = value / root[i, i] if i >= axis else 0.0
            if i >= axis:
                total += column[i] * column[i]
        out[axis] = total
    return True


@scalar_kernel
def _level_m(axis, count, probabilities, variances, asked):
    """The level of an axis (1,); of all hypotheses."""
    risk, sigmas_alarm = asked
    low, high = 0.0, FARTHEST_M
    for _ in range(60):
        middle = 0.5 * (low + high)
        total = 2.0 * probabilities[WELL] * _tail(middle / math.sqrt(variances[WELL, axis]))
        for h in range(1, count):
            apart = math.sqrt(max(variances[h, axis] - variances[WELL, axis], 0.0))
            total += probabilities[h] * _tail((middle - sigmas_alarm * apart) / math.sqrt(variances[h, axis]))
        if total > risk:
            low = middle
        else:
            high = middle
    return high if high < 0.999 * FARTHEST_M else math.inf


@scalar_kernel
def _point(rows, sigmas, faults, asked, most_hypotheses, levels):
    """Levels (3,) east, north, up of one point, and the risk that no hypothesis covers."""
    m, n = rows.shape
    used = np.empty(m, np.int64)
    k = 0
    whole = np.zeros((n, n))
    for i in range(m):
        if sigmas[i] < math.inf:
            used[k] = i
            k += 1
            for a in range(n):
                for b in range(n):
                    whole[a, b] += rows[i, a] * rows[i, b] / (sigmas[i] * sigmas[i])
    probabilities, variances = np.zeros(most_hypotheses), np.zeros((most_hypotheses, 3))
    levels[:] = math.inf
    if k < n or not _variances(whole, variances[WELL]):
        return 1.0
    none = 1.0
    for c in range(k):
        none *= 1.0 - faults[used[c]]
    probabilities[WELL] = none
    covered, count = none, 1
    without = np.empty((n, n))
    for f in range(1, min(int(asked[MOST]), k) + 1):
        if 1.0 - covered <= asked[UNWATCHED]:
            break
        chosen = np.arange(f)
        while True:
            probability = none
            without[:] = whole
            for c in range(f):
                i = used[chosen[c]]
                probability *= faults[i] / (1.0 - faults[i])
                for a in range(n):
                    for b in range(n):
                        without[a, b] -= rows[i, a] * rows[i, b] / (sigmas[i] * sigmas[i])
            if probability > 0.0 and k - f >= n and _variances(without, variances[count]):
                probabilities[count] = probability
                covered += probability
                count += 1
            c = f - 1
            while c >= 0 and chosen[c] == k - f + c:
                c -= 1
            if c < 0:
                break
            chosen[c] += 1
            for d in range(c + 1, f):
                chosen[d] = chosen[d - 1] + 1
    missed = max(1.0 - covered, 0.0)
    left = asked[RISK] - missed
    if left <= 0.0:
        return missed
    # half of the risk is for the height, a quarter for each horizontal axis; alarms are shared by all tests
    sigmas_alarm = _sigma_of_tail(asked[ALARM] / (2.0 * 3.0 * max(count - 1, 1)))
    for axis in range(3):
        share = 0.5 if axis == UP else 0.25
        levels[axis] = _level_m(axis, count, probabilities, variances, (left * share, sigmas_alarm))
    return missed


@parallel_kernel
def protection_levels(rows, sigmas, faults, asked, most_hypotheses, levels, missed):
    """Fill levels (p, 3) east, north, up and missed (p,) of p points.

    rows: (p, m, n) with the position first; sigmas: (p, m), inf = not in sight; faults: (p, m) probability that each is
    wrong, below 1; asked: RISK, ALARM, UNWATCHED, MOST; most_hypotheses: room for all sets.
    """
    for p in prange(rows.shape[0]):
        missed[p] = _point(rows[p], sigmas[p], faults[p], asked, most_hypotheses, levels[p])
