"""Hypotheses about which ranges lie: each a belief at constant velocity, with the excess of every range beside it.

A belief is the state of ``ranges`` without a clock, 6 numbers, and the excess of the range to each of k anchors: 6 + k.
Of a range that is in sight the excess is 0 and known for certain. A range that is taken in makes up to three hypotheses
of one: it is right, it lies by as much as before, or by another excess, floor + Exp(mean), whose posterior is a
truncated Gaussian and is met by its first two moments.
"""

import math
from typing import NamedTuple

import numpy as np

from compiled.options import scalar_kernel

from .ranges import EAST, NORTH, UP, bend_m2

__all__ = [
    "FLOOR",
    "KEPT",
    "MEAN",
    "SHARE",
    "Bank",
    "advance_bank",
    "blend",
    "excess_moments",
    "log_normal",
    "merge",
    "take_range",
]

STATE = 6
RIGHT, SAME, OTHER = 0, 1, 2
# columns of regimes: share of ranges that lie, seconds that one goes on lying
SHARE, KEPT = 0, 1
# places of the excess' law: least, mean beyond it
FLOOR, MEAN = 0, 1
# what scratch holds of a branch
WEIGHT, INNOVATION, EXCESS, SPREAD = 0, 1, 2, 3
HELD = 0  # how many hypotheses a bank holds stands in an array of one
# of what lies, so much keeps its excess from range to range; the rest draws another
STEADY = 0.5
APART = 6.0  # sigmas between places that are not those of one belief
FAINT = 12.0  # log of how much less likely a hypothesis may be than the best
LOG_ROOT_TAU = 0.5 * math.log(2.0 * math.pi)


class Bank(NamedTuple):
    """h hypotheses, the first held[0] of which are there: means (h, 6 + k), covariances (h, 6 + k, 6 + k), lying
    (h, k) uint8, regimes (h,), log weights (h,); held (1,)."""

    means: np.ndarray
    covariances: np.ndarray
    lying: np.ndarray
    regimes: np.ndarray
    weights: np.ndarray
    held: np.ndarray


@scalar_kernel
def advance_bank(bank, step_s, psd):
    """All beliefs after step_s, in place; psd (4,): east, north, up, clock."""
    n = bank.means.shape[1]
    for h in range(bank.held[HELD]):
        mean, covariance = bank.means[h], bank.covariances[h]
        for i in range(0, STATE, 2):
            mean[i] += step_s * mean[i + 1]
            for j in range(n):
                covariance[i, j] += step_s * covariance[i + 1, j]
            for j in range(n):
                covariance[j, i] += step_s * covariance[j, i + 1]
            noise = psd[i // 2]
            covariance[i, i] += noise * step_s**3 / 3.0
            covariance[i, i + 1] += noise * step_s**2 / 2.0
            covariance[i + 1, i] += noise * step_s**2 / 2.0
            covariance[i + 1, i + 1] += noise * step_s


@scalar_kernel
def log_normal(value, variance):
    """log of the density of N(0, variance) at a value."""
    return -0.5 * value * value / variance - 0.5 * math.log(variance) - LOG_ROOT_TAU


@scalar_kernel
def _log_tail(x):
    """log of Φ(x)."""
    if x > -8.0:
        return math.log(0.5 * math.erfc(-x / math.sqrt(2.0)))
    return -0.5 * x * x - math.log(-x) - LOG_ROOT_TAU


@scalar_kernel
def excess_moments(seen, variance, law):
    """(log likelihood, mean, variance) of an excess, floor + Exp(mean), seen with Gaussian noise of a variance."""
    shifted = seen - law[FLOOR]
    centre = shifted - variance / law[MEAN]
    root = math.sqrt(variance)
    x = centre / root
    log_tail = _log_tail(x)
    likelihood = -math.log(law[MEAN]) - shifted / law[MEAN] + 0.5 * variance / law[MEAN] ** 2 + log_tail
    # the Gaussian about the centre, cut off at 0
    ratio = math.exp(log_normal(x, 1.0) - log_tail)
    mean = centre + root * ratio
    spread = variance * max(1.0 - ratio * (x + ratio), 1e-3)
    return likelihood, law[FLOOR] + mean, spread


@scalar_kernel
def _row(mean, anchor_m, row):
    """Fill row (6 + k,) of the range to an anchor (3,), without its excess, and return the range."""
    row[:] = 0.0
    east, north, up = mean[EAST] - anchor_m[0], mean[NORTH] - anchor_m[1], mean[UP] - anchor_m[2]
    length = math.sqrt(east * east + north * north + up * up)
    if length > 0.0:
        row[EAST], row[NORTH], row[UP] = east / length, north / length, up / length
    return length


@scalar_kernel
def _branch_priors(was_lying, share, kept, priors):
    """Fill priors (3,) of RIGHT, SAME, OTHER. share: of ranges that lie; kept: probability that nothing changed."""
    if was_lying:
        priors[SAME] = STEADY * kept
        priors[OTHER] = (1.0 - STEADY) * kept + (1.0 - kept) * share
    else:
        priors[SAME] = 0.0
        priors[OTHER] = (1.0 - kept) * share
    priors[RIGHT] = 1.0 - priors[SAME] - priors[OTHER]


@scalar_kernel
def _update(parent, branch, a, innovation, gains, child):
    """Make a child of a parent (mean, covariance) in place. gains: (P row (n,), S, excess mean, its variance)."""
    mean, covariance = child
    mean[:], covariance[:] = parent
    gain, variance, excess, spread = gains
    place = STATE + a
    n = mean.shape[0]
    if branch != SAME:
        # what was believed of the old excess is of no use any more
        mean[place] = 0.0
        covariance[place, :] = 0.0
        covariance[:, place] = 0.0
    # with an excess that is only known by its moments, part of what the range would have told is not told
    told = (1.0 - spread / variance) / variance
    for i in range(n):
        mean[i] += gain[i] / variance * innovation
        for j in range(n):
            covariance[i, j] -= gain[i] * told * gain[j]
    if branch == OTHER:
        mean[place] = excess
        for i in range(n):
            covariance[place, i] = -gain[i] / variance * spread
            covariance[i, place] = covariance[place, i]
        covariance[place, place] = spread


@scalar_kernel
def take_range(bank, spare, a, measured, regimes, law, scratch):
    """Take in the range to anchor a; the hypotheses that are left stand in the bank.

    measured: (anchor (3,), range, variance, seconds since the ranges before, probability of sight). regimes: (r, 2).
    scratch: (h, 3, 4) log weight, innovation, excess mean and variance of each branch. Weights are made to sum to 1.
    """
    anchor, range_m, variance_m2, since_s, sight = measured
    n, most, count = bank.means.shape[1], bank.means.shape[0], bank.held[HELD]
    row, gain, priors = np.empty(n), np.empty(n), np.empty(3)
    best = -math.inf
    for h in range(count):
        regime = regimes[bank.regimes[h]]
        kept = math.exp(-since_s / regime[KEPT]) if regime[KEPT] > 0.0 else 0.0
        share = 1.0 - sight * (1.0 - regime[SHARE])
        _branch_priors(bank.lying[h, a], share, kept, priors)
        expected = _row(bank.means[h], anchor, row)
        for branch in range(3):
            scratch[h, branch, WEIGHT] = -math.inf
            if priors[branch] <= 0.0:
                continue
            row[STATE + a] = 1.0 if branch == SAME else 0.0
            variance = variance_m2 + bend_m2(bank.means[h], bank.covariances[h], anchor)
            for i in range(n):
                for j in range(n):
                    variance += row[i] * bank.covariances[h, i, j] * row[j]
            innovation = range_m - expected
            excess, spread = 0.0, 0.0
            if branch == OTHER:
                likelihood, excess, spread = excess_moments(innovation, variance, law)
                innovation -= excess
            else:
                if branch == SAME:
                    innovation -= bank.means[h, STATE + a]
                likelihood = log_normal(innovation, variance)
            weight = bank.weights[h] + math.log(priors[branch]) + likelihood
            scratch[h, branch, WEIGHT], scratch[h, branch, INNOVATION] = weight, innovation
            scratch[h, branch, EXCESS], scratch[h, branch, SPREAD] = excess, spread
            best = max(best, weight)
    # the likeliest of them, as many as there is room for
    order = np.argsort(-scratch[:count, :, WEIGHT].copy().reshape(3 * count))
    made, total = 0, 0.0
    for place in order:
        h, branch = place // 3, place % 3
        weight = scratch[h, branch, WEIGHT]
        if made == most or not weight > best - FAINT:
            break
        _row(bank.means[h], anchor, row)
        row[STATE + a] = 1.0 if branch == SAME else 0.0
        variance = variance_m2 + bend_m2(bank.means[h], bank.covariances[h], anchor)
        for i in range(n):
            gain[i] = 0.0
            for j in range(n):
                gain[i] += bank.covariances[h, i, j] * row[j]
        if branch != SAME:
            gain[STATE + a] = 0.0
        for i in range(n):
            variance += row[i] * gain[i]
        gains = gain, variance, scratch[h, branch, EXCESS], scratch[h, branch, SPREAD]
        parent, child = (bank.means[h], bank.covariances[h]), (spare.means[made], spare.covariances[made])
        _update(parent, branch, a, scratch[h, branch, INNOVATION], gains, child)
        spare.lying[made] = bank.lying[h]
        spare.lying[made, a] = 0 if branch == RIGHT else 1
        spare.regimes[made], spare.weights[made] = bank.regimes[h], weight
        total += math.exp(weight - best)
        made += 1
    bank.held[HELD] = made
    for h in range(made):
        bank.means[h], bank.covariances[h] = spare.means[h], spare.covariances[h]
        bank.lying[h], bank.regimes[h] = spare.lying[h], spare.regimes[h]
        bank.weights[h] = spare.weights[h] - best - math.log(total)


@scalar_kernel
def _apart(bank, one, other):
    """Whether two hypotheses believe in places that exclude one another, as on both sides of a plane of anchors."""
    for i in (EAST, NORTH, UP):
        spread = bank.covariances[one, i, i] + bank.covariances[other, i, i]
        if (bank.means[one, i] - bank.means[other, i]) ** 2 > APART**2 * spread:
            return True
    return False


@scalar_kernel
def merge(bank):
    """Hypotheses that say the same of now, and differ only in what they say of before, become one, in place.

    Those whose places exclude one another stay two.
    """
    made, n = 0, bank.means.shape[1]
    shift = np.empty(n)
    for h in range(bank.held[HELD]):
        twin = -1
        for m in range(made):
            if bank.regimes[m] != bank.regimes[h] or not (bank.lying[m] == bank.lying[h]).all():
                continue
            if not _apart(bank, m, h):
                twin = m
                break
        if twin < 0:
            if made != h:
                bank.means[made], bank.covariances[made] = bank.means[h], bank.covariances[h]
                bank.lying[made], bank.regimes[made] = bank.lying[h], bank.regimes[h]
                bank.weights[made] = bank.weights[h]
            made += 1
            continue
        top = max(bank.weights[twin], bank.weights[h])
        ours, theirs = math.exp(bank.weights[twin] - top), math.exp(bank.weights[h] - top)
        share = theirs / (ours + theirs)
        shift[:] = bank.means[h] - bank.means[twin]
        for i in range(n):
            bank.means[twin, i] += share * shift[i]
            for j in range(n):
                between = share * (1.0 - share) * shift[i] * shift[j]
                bank.covariances[twin, i, j] += (
                    share * (bank.covariances[h, i, j] - bank.covariances[twin, i, j]) + between
                )
        bank.weights[twin] = top + math.log(ours + theirs)
    bank.held[HELD] = made


@scalar_kernel
def blend(bank, mean, covariance):
    """Fill mean (6,) and covariance (6, 6) of all hypotheses together."""
    mean[:] = 0.0
    covariance[:] = 0.0
    for h in range(bank.held[HELD]):
        weight = math.exp(bank.weights[h])
        for i in range(STATE):
            mean[i] += weight * bank.means[h, i]
    for h in range(bank.held[HELD]):
        weight = math.exp(bank.weights[h])
        for i in range(STATE):
            for j in range(STATE):
                apart = (bank.means[h, i] - mean[i]) * (bank.means[h, j] - mean[j])
                covariance[i, j] += weight * (bank.covariances[h, i, j] + apart)
