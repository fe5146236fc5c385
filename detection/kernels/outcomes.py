"""One range and what may be behind it: outcomes weighed by how well they foretell it, their mixture made one Gaussian.

The state is that of ``track``: place, velocity, the excess all ranges share, and the excess of each anchor.
"""

import math
from typing import NamedTuple

from compiled.options import scalar_kernel

__all__ = [
    "CLEARED",
    "FAR",
    "GAINS",
    "GOES_ON",
    "NEW",
    "OUTCOMES",
    "OUTLIER",
    "SHARED",
    "STATES",
    "E",
    "N",
    "Told",
    "U",
    "set_outcome",
    "way_from",
    "weigh",
]

STATES = 7  # place, velocity, shared excess; then one excess per anchor
E, N, U = 0, 1, 2
SHARED = 6
GOES_ON, CLEARED, NEW, FAR = 0, 1, 2, 3  # the excess, or is new and far longer than usual
GAUSSIANS = 4
OUTLIER = 4  # or the range is off by anything
OUTCOMES = 5
ODDS, MEAN, VARIANCE = 0, 1, 2  # columns of outcomes
SPREAD, VARIANCES, SHARES, GAINS = 0, 1, 2, 3  # rows of the scratch of one update; gains of each outcome from there on
SQRT_2_PI = math.sqrt(2.0 * math.pi)  # what the Gaussian densities below leave out


class Told(NamedTuple):
    """One range, the variance of its noise, its excess over where the others meet, the variance of that.

    seldom: a factor on what is new or an outlier where they tell. scale_m: of outliers.
    """

    range_m: float
    noise: float
    by_others_m: float
    by_others_variance: float
    seldom: float
    scale_m: float


@scalar_kernel
def way_from(state, anchor):
    """(distance, unit vector from the anchor to the rover)."""
    east, north, up = state[E] - anchor[E], state[N] - anchor[N], state[U] - anchor[U]
    distance = max(math.sqrt(east * east + north * north + up * up), 1e-6)
    return distance, east / distance, north / distance, up / distance


@scalar_kernel
def _foretold(outcomes, miss, variances, scale):
    """(log of the density of a range, its share of each outcome) from odds; outlier: Cauchy's density of a scale.

    miss, variances: (OUTCOMES,) of the range against each Gaussian outcome. Shares are written over ``miss``.
    """
    surplus = miss[OUTLIER]
    best = -math.inf
    for h in range(OUTCOMES):
        log_odds = math.log(max(outcomes[h, ODDS], 1e-12))
        if h == OUTLIER:
            log_odds -= math.log(math.pi / SQRT_2_PI * scale * (1.0 + (surplus / scale) ** 2))
        else:
            log_odds -= 0.5 * (miss[h] * miss[h] / variances[h] + math.log(variances[h]))
        miss[h] = log_odds
        best = max(best, log_odds)
    total = 0.0
    for h in range(OUTCOMES):
        miss[h] = math.exp(miss[h] - best)
        total += miss[h]
    for h in range(OUTCOMES):
        miss[h] /= total
    return best + math.log(total)


@scalar_kernel
def weigh(state, covariance, anchor, own, told, outcomes, work):
    """Update with one range, in place; log-likelihood of the range. own: index of the anchor's excess.

    told: a Told. outcomes: (OUTCOMES, 3) rows of ODDS, MEAN, VARIANCE of the excess; the mean and variance of what goes
    on are the state's own, an outlier has none. work: scratch (GAINS + OUTCOMES, size).
    """
    range_m, noise, by_others, by_others_variance, seldom, scale = told
    size = state.shape[0]
    distance, east, north, up = way_from(state, anchor)
    spread = work[SPREAD]
    for k in range(size):
        spread[k] = east * covariance[k, E] + north * covariance[k, N] + up * covariance[k, U] + covariance[k, SHARED]
    known = east * spread[E] + north * spread[N] + up * spread[U] + spread[SHARED]
    surplus = range_m - distance - state[SHARED]
    outcomes[GOES_ON, MEAN], outcomes[GOES_ON, VARIANCE] = state[own], covariance[own, own]
    shares, variances = work[SHARES], work[VARIANCES]
    for h in range(GAUSSIANS):
        cross = 2.0 * spread[own] if h == GOES_ON else 0.0
        variances[h] = max(known + outcomes[h, VARIANCE] + noise + cross, noise)
        shares[h] = surplus - outcomes[h, MEAN]
    shares[OUTLIER] = surplus
    log_likelihood = _foretold(outcomes, shares, variances, scale)
    if by_others_variance < math.inf:
        # shares by the place that the track and the other ranges of the epoch make out together; gains by the track
        trust = known / (known + by_others_variance)
        both = surplus + trust * (by_others - surplus)
        for h in range(GAUSSIANS):
            cross = 2.0 * spread[own] if h == GOES_ON else 0.0
            variances[h] = max((1.0 - trust) * (known + cross) + outcomes[h, VARIANCE] + noise, noise)
            shares[h] = both - outcomes[h, MEAN]
        shares[OUTLIER] = both
        for h in range(NEW, OUTCOMES):
            outcomes[h, ODDS] *= seldom
        _foretold(outcomes, shares, variances, scale)
        for h in range(GAUSSIANS):
            cross = 2.0 * spread[own] if h == GOES_ON else 0.0
            variances[h] = max(known + outcomes[h, VARIANCE] + noise + cross, noise)
    for h in range(OUTCOMES):
        outcomes[h, ODDS] = shares[h]
    misses = shares  # written last
    for h in range(GAUSSIANS):
        misses[h] = surplus - outcomes[h, MEAN]
    # gains and means of the outcomes, then the mixture; an outlier leaves everything as it was
    outcomes[OUTLIER, MEAN], variances[OUTLIER], misses[OUTLIER] = state[own], 1.0, 0.0
    mean = spread  # written last
    for h in range(OUTCOMES):
        gains = work[GAINS + h]
        for k in range(size):
            gains[k] = 0.0 if h == OUTLIER else spread[k] + (covariance[k, own] if h == GOES_ON else 0.0)
        if GOES_ON < h < OUTLIER:
            gains[own] = outcomes[h, VARIANCE]
    for k in range(size):
        total = 0.0
        for h in range(OUTCOMES):
            prior = outcomes[h, MEAN] if k == own else state[k]
            total += outcomes[h, ODDS] * (prior + work[GAINS + h, k] / variances[h] * misses[h])
        mean[k] = total
    as_before = outcomes[GOES_ON, ODDS] + outcomes[OUTLIER, ODDS]
    for k in range(size):
        for j in range(k + 1):
            if k == own or j == own:
                value = as_before * covariance[k, j]
                if k == j:
                    for h in range(CLEARED, OUTLIER):
                        value += outcomes[h, ODDS] * outcomes[h, VARIANCE]
            else:
                value = covariance[k, j]
            for h in range(OUTCOMES):
                gain_k, gain_j = work[GAINS + h, k] / variances[h], work[GAINS + h, j]
                off_k = (outcomes[h, MEAN] if k == own else state[k]) + gain_k * misses[h] - mean[k]
                off_j = (outcomes[h, MEAN] if j == own else state[j]) + gain_j / variances[h] * misses[h] - mean[j]
                value += outcomes[h, ODDS] * (off_k * off_j - gain_k * gain_j)
            covariance[k, j] = value
    for k in range(size):
        state[k] = mean[k]
        for j in range(k):
            covariance[j, k] = covariance[k, j]
    return log_likelihood


@scalar_kernel
def set_outcome(outcomes, h, odds, mean, variance):
    """Write the row of one outcome."""
    outcomes[h, ODDS], outcomes[h, MEAN], outcomes[h, VARIANCE] = odds, mean, variance
