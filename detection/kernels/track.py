"""The rover's track and what each anchor adds to its ranges, filtered range by range.

The state is Gaussian: place (3), velocity (3), the excess all ranges share, and the excess of each anchor (n). Between
ranges the rover keeps its level velocity but for accelerations, and soon forgets a vertical one; excesses creep. At a
range its anchor's excess goes on, is cleared, or is new, or the range is an outlier of any size and sign, which says
nothing; the outcomes are weighed by how well they foretell the range, and their mixture is made one Gaussian again
(seed 000 has no such witness; it is an interacting mixture of the first order). Where the other ranges of the epoch
agree on a place, the outcomes are foretold from there as well: a track that is unsure has no say in what is too long.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from compiled.options import scalar_kernel

from .misfits import EXCESS
from .misfits import VARIANCE as EXCESS_VARIANCE

__all__ = ["SHARED", "STATES", "Belief", "Creep", "Measured", "Odds", "Push", "follow", "pull"]

STATES = 7  # place, velocity, shared excess; then one excess per anchor
E, N, U = 0, 1, 2
VELOCITY = 3
CLIMB = 5
SHARED = 6
GOES_ON, CLEARED, NEW, FAR = 0, 1, 2, 3  # the excess, or is new and far longer than usual
GAUSSIANS = 4
OUTLIER = 4  # or the range is off by anything
OUTCOMES = 5
ODDS, MEAN, VARIANCE = 0, 1, 2  # columns of outcomes
SPREAD, VARIANCES, SHARES, GAINS = 0, 1, 2, 3  # rows of the scratch of one update; gains of each outcome from there on
SQRT_2_PI = math.sqrt(2.0 * math.pi)  # what the Gaussian densities below leave out
MEETS = 3.0  # sigmas up to which a range meets the others of its epoch
FORGOTTEN_S = 2.0  # what was known of an anchor's excess so long ago says no more of when it changed


class Push(NamedTuple):
    """Level and vertical accelerations, m/s^1.5, and the rate, 1/s, at which a climb is forgotten."""

    level: float
    vertical: float
    forgotten_per_s: float


class Creep(NamedTuple):
    """How an excess wanders: m/sqrt(s), the share of itself per sqrt(s), the rate, 1/s, back to its mean (m)."""

    m_per_root_s: float
    of_itself: float
    back_per_s: float
    mean_m: float


class Odds(NamedTuple):
    """What the outcomes of a range are worth.

    anew_per_s: rate at which an anchor's sight is drawn anew. new_m, new_sigma_m: mean and sigma of a new excess.
    noise, cleared: sigmas as shares of a range's. far_share, far_sigma_m: of new excesses, those that are far longer.
    outliers: their share among ranges, spread like far ones. meeting: a factor on what is new, or an outlier, of a
    range that meets the others.
    """

    anew_per_s: float
    new_m: float
    new_sigma_m: float
    noise: float
    cleared: float
    far_share: float
    far_sigma_m: float
    outliers: float
    meeting: float


class Belief(NamedTuple):
    """state (7 + n,), covariance, time of the state, times (n,) each anchor was last heard."""

    state: Any
    covariance: Any
    time_s: float
    heard_s: Any


class Measured(NamedTuple):
    """Anchors (n, 3); of each range (m,) the index of its anchor, range, sigma, time, probability of sight.

    by_others: (m, 2) EXCESS over where the others of the epoch meet, with the variance of that (inf = not told).
    """

    anchors_m: Any
    index: Any
    ranges_m: Any
    sigmas_m: Any
    times_s: Any
    p_sight: Any
    by_others: Any


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
def _predict(state, covariance, step_s, push, creep, flat):
    """Carry the state over a time step, in place."""
    if step_s <= 0.0:
        return
    size = state.shape[0]
    for axis in range(3):
        state[axis] += step_s * state[VELOCITY + axis]
        for k in range(size):
            covariance[axis, k] += step_s * covariance[VELOCITY + axis, k]
    for axis in range(3):
        for k in range(size):
            covariance[k, axis] += step_s * covariance[k, VELOCITY + axis]
    forget = math.exp(-push.forgotten_per_s * step_s)
    state[CLIMB] *= forget
    for k in range(size):
        covariance[CLIMB, k] *= forget
    for k in range(size):
        covariance[k, CLIMB] *= forget
    for axis in range(2 if flat else 3):
        rate = VELOCITY + axis
        power = push.level * push.level if axis < U else push.vertical * push.vertical
        covariance[axis, axis] += power * step_s * step_s * step_s / 3.0
        covariance[axis, rate] += power * step_s * step_s / 2.0
        covariance[rate, axis] += power * step_s * step_s / 2.0
        covariance[rate, rate] += power * step_s
    back = math.exp(-creep.back_per_s * step_s)
    # of white noise over a step, what is left of it at the end
    lasting_s = (1.0 - back * back) / (2.0 * creep.back_per_s)
    for k in range(STATES, size):
        rate2 = creep.m_per_root_s * creep.m_per_root_s + (creep.of_itself * max(state[k], 0.0)) ** 2
        state[k] = creep.mean_m + (state[k] - creep.mean_m) * back
        for j in range(size):
            covariance[k, j] *= back
        for j in range(size):
            covariance[j, k] *= back
        covariance[k, k] += rate2 * lasting_s


@scalar_kernel
def _direction(state, anchor):
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
def _weigh(state, covariance, anchor, own, told, outcomes, work):
    """Update with one range, in place; log-likelihood of the range. own: index of the anchor's excess.

    told: a Told. outcomes: (OUTCOMES, 3) rows of ODDS, MEAN, VARIANCE of the excess; the mean and variance of what goes
    on are the state's own, an outlier has none. work: scratch (GAINS + OUTCOMES, size).
    """
    range_m, noise, by_others, by_others_variance, seldom, scale = told
    size = state.shape[0]
    distance, east, north, up = _direction(state, anchor)
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
def pull(state, covariance, direction, measured, variance):
    """Update, in place, with a measured combination of states: direction · state = measured, of a variance."""
    size = state.shape[0]
    spread = covariance @ direction
    total = variance + direction @ spread
    miss = measured - direction @ state
    for k in range(size):
        state[k] += spread[k] / total * miss
        for j in range(size):
            covariance[k, j] -= spread[k] * spread[j] / total


@scalar_kernel
def _set(outcomes, h, odds, mean, variance):
    """Write the row of one outcome."""
    outcomes[h, ODDS], outcomes[h, MEAN], outcomes[h, VARIANCE] = odds, mean, variance


@scalar_kernel
def follow(belief, measured, order, end_s, push, creep, odds, flat):
    """(state, covariance, heard_s, log-likelihood, excess_m, sigma_m) after an epoch's ranges, in an order of times.

    belief, measured, push, creep, odds: a Belief, Measured, Push, Creep and Odds. order: (m,) of the ranges' times.
    excess_m, sigma_m: of every range against the place at its time, as known at the end.
    """
    state, covariance, heard_s = belief.state.copy(), belief.covariance.copy(), belief.heard_s.copy()
    anchors, index, ranges, sigmas, times_s, p_sight, by_others = measured
    now_s = belief.time_s
    size, count = state.shape[0], ranges.shape[0]
    work = np.zeros((GAINS + OUTCOMES, size))
    outcomes = np.zeros((OUTCOMES, 3))
    log_likelihood = 0.0
    for m in order:
        _predict(state, covariance, times_s[m] - now_s, push, creep, flat)
        now_s = max(now_s, times_s[m])
        i = index[m]
        since_s = min(max(times_s[m] - heard_s[i], 0.0), FORGOTTEN_S)
        heard_s[i] = times_s[m]
        anew = 1.0 - math.exp(-odds.anew_per_s * since_s)
        clearing = anew * min(max(p_sight[m], 0.01), 0.99)
        occluding = anew - clearing
        _set(outcomes, GOES_ON, max(1.0 - anew, 0.01), 0.0, 0.0)
        _set(outcomes, CLEARED, clearing, creep.mean_m, (odds.cleared * sigmas[m]) ** 2)
        _set(outcomes, NEW, occluding * (1.0 - odds.far_share), odds.new_m, odds.new_sigma_m * odds.new_sigma_m)
        _set(outcomes, FAR, occluding * odds.far_share, odds.new_m, odds.far_sigma_m * odds.far_sigma_m)
        _set(outcomes, OUTLIER, odds.outliers, 0.0, 0.0)
        excess_m, variance = by_others[m, EXCESS], by_others[m, EXCESS_VARIANCE]
        meets = excess_m**2 <= MEETS * MEETS * (variance + sigmas[m] * sigmas[m])
        seldom = odds.meeting if meets else 1.0
        told = Told(ranges[m], (odds.noise * sigmas[m]) ** 2, excess_m, variance, seldom, odds.far_sigma_m)
        log_likelihood += _weigh(state, covariance, anchors[i], STATES + i, told, outcomes, work)
    _predict(state, covariance, end_s - now_s, push, creep, flat)
    excess, sigma = np.zeros(count), np.zeros(count)
    then = state.copy()
    for m in range(count):
        for axis in range(3):
            then[axis] = state[axis] - (max(end_s, now_s) - times_s[m]) * state[VELOCITY + axis]
        distance, east, north, up = _direction(then, anchors[index[m]])
        excess[m] = ranges[m] - distance
        sigma[m] = math.sqrt(
            max(
                east * east * covariance[E, E]
                + north * north * covariance[N, N]
                + up * up * covariance[U, U]
                + 2.0
                * (east * north * covariance[E, N] + east * up * covariance[E, U] + north * up * covariance[N, U]),
                0.0,
            )
        )
    return state, covariance, heard_s, log_likelihood, excess, sigma
