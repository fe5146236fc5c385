"""The rover's track and what each anchor adds to its ranges, filtered range by range.

The state is Gaussian: place (3), velocity (3), the excess all ranges share, and the excess of each anchor (n). Between
ranges the rover keeps its level velocity but for accelerations, and soon forgets a vertical one; excesses creep. At a
range its anchor's excess goes on, is cleared, or is new, or the range is an outlier of any size and sign, which says
nothing; the outcomes are weighed by how well they foretell the range, and their mixture is made one Gaussian again
(seed 000 has no such witness; it is an interacting mixture of the first order). Where the other ranges of the epoch
agree on a place, the outcomes are foretold from there as well: a track that is unsure has no say in what is too long.
"""

import math

import numpy as np

from compiled.options import scalar_kernel

__all__ = ["SHARED", "STATES", "follow", "pull"]

STATES = 7  # place, velocity, shared excess; then one excess per anchor
SHARED = 6
GAUSSIANS = 4  # the excess goes on, is cleared, is new, is new and far longer than usual
OUTLIER = 4  # or the range is off by anything
OUTCOMES = 5
SQRT_2_PI = math.sqrt(2.0 * math.pi)  # what the Gaussian densities below leave out
MEETS = 3.0  # sigmas up to which a range meets the others of its epoch
FORGOTTEN_S = 2.0  # what was known of an anchor's excess so long ago says no more of when it changed


@scalar_kernel
def _predict(state, covariance, step_s, motion, creep, flat):
    """Carry the state over a time step, in place. motion: level and vertical acceleration, m/s^1.5, and 1/s at which a
    climb is forgotten; creep: m/sqrt(s) of an excess, share of itself, 1/s back to its mean, that mean."""
    if step_s <= 0.0:
        return
    size = state.shape[0]
    for axis in range(3):
        state[axis] += step_s * state[3 + axis]
        for k in range(size):
            covariance[axis, k] += step_s * covariance[3 + axis, k]
    for axis in range(3):
        for k in range(size):
            covariance[k, axis] += step_s * covariance[k, 3 + axis]
    forget = math.exp(-motion[2] * step_s)
    state[5] *= forget
    for k in range(size):
        covariance[5, k] *= forget
    for k in range(size):
        covariance[k, 5] *= forget
    for axis in range(2 if flat else 3):
        push = motion[0] * motion[0] if axis < 2 else motion[1] * motion[1]
        covariance[axis, axis] += push * step_s * step_s * step_s / 3.0
        covariance[axis, 3 + axis] += push * step_s * step_s / 2.0
        covariance[3 + axis, axis] += push * step_s * step_s / 2.0
        covariance[3 + axis, 3 + axis] += push * step_s
    back = math.exp(-creep[2] * step_s)
    # of white noise over a step, what is left of it at the end
    lasting_s = (1.0 - back * back) / (2.0 * creep[2])
    for k in range(STATES, size):
        rate2 = creep[0] * creep[0] + (creep[1] * max(state[k], 0.0)) ** 2
        state[k] = creep[3] + (state[k] - creep[3]) * back
        for j in range(size):
            covariance[k, j] *= back
        for j in range(size):
            covariance[j, k] *= back
        covariance[k, k] += rate2 * lasting_s


@scalar_kernel
def _direction(state, anchor):
    """(distance, unit vector from the anchor to the rover)."""
    east, north, up = state[0] - anchor[0], state[1] - anchor[1], state[2] - anchor[2]
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
        log_odds = math.log(max(outcomes[h, 0], 1e-12))
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
def _weigh(state, covariance, anchor, own, measured, outcomes, scale, work):
    """Update with one range, in place; log-likelihood of the range. own: index of the anchor's excess.

    measured: range, variance of its noise, excess over the place where the others of its epoch meet, variance of that,
    factor on what is new or an outlier where they tell.
    outcomes: (OUTCOMES, 3) rows of odds, mean, variance of the excess; the first row's mean and variance are the
    state's own, an outlier has none. scale: m, of outliers. work: scratch (3 + OUTCOMES, size).
    """
    range_m, noise, by_others, by_others_variance, seldom = measured
    size = state.shape[0]
    distance, east, north, up = _direction(state, anchor)
    spread = work[0]
    for k in range(size):
        spread[k] = east * covariance[k, 0] + north * covariance[k, 1] + up * covariance[k, 2] + covariance[k, SHARED]
    known = east * spread[0] + north * spread[1] + up * spread[2] + spread[SHARED]
    surplus = range_m - distance - state[SHARED]
    outcomes[0, 1], outcomes[0, 2] = state[own], covariance[own, own]
    shares, variances = work[2], work[1]
    for h in range(GAUSSIANS):
        variances[h] = max(known + outcomes[h, 2] + noise + (2.0 * spread[own] if h == 0 else 0.0), noise)
        shares[h] = surplus - outcomes[h, 1]
    shares[OUTLIER] = surplus
    log_likelihood = _foretold(outcomes, shares, variances, scale)
    if by_others_variance < math.inf:
        # shares by the place that the track and the other ranges of the epoch make out together; gains by the track
        trust = known / (known + by_others_variance)
        both = surplus + trust * (by_others - surplus)
        for h in range(GAUSSIANS):
            cross = 2.0 * spread[own] if h == 0 else 0.0
            variances[h] = max((1.0 - trust) * (known + cross) + outcomes[h, 2] + noise, noise)
            shares[h] = both - outcomes[h, 1]
        shares[OUTLIER] = both
        for h in range(2, OUTCOMES):
            outcomes[h, 0] *= seldom
        _foretold(outcomes, shares, variances, scale)
        for h in range(GAUSSIANS):
            variances[h] = max(known + outcomes[h, 2] + noise + (2.0 * spread[own] if h == 0 else 0.0), noise)
    for h in range(OUTCOMES):
        outcomes[h, 0] = shares[h]
    misses = shares  # written last
    for h in range(GAUSSIANS):
        misses[h] = surplus - outcomes[h, 1]
    # gains and means of the outcomes, then the mixture; an outlier leaves everything as it was
    outcomes[OUTLIER, 1], variances[OUTLIER], misses[OUTLIER] = state[own], 1.0, 0.0
    mean = spread  # written last
    for h in range(OUTCOMES):
        gains = work[3 + h]
        for k in range(size):
            gains[k] = 0.0 if h == OUTLIER else spread[k] + (covariance[k, own] if h == 0 else 0.0)
        if 0 < h < OUTLIER:
            gains[own] = outcomes[h, 2]
    for k in range(size):
        total = 0.0
        for h in range(OUTCOMES):
            prior = outcomes[h, 1] if k == own else state[k]
            total += outcomes[h, 0] * (prior + work[3 + h, k] / variances[h] * misses[h])
        mean[k] = total
    as_before = outcomes[0, 0] + outcomes[OUTLIER, 0]
    for k in range(size):
        for j in range(k + 1):
            if k == own or j == own:
                value = as_before * covariance[k, j]
                if k == j:
                    for h in range(1, OUTLIER):
                        value += outcomes[h, 0] * outcomes[h, 2]
            else:
                value = covariance[k, j]
            for h in range(OUTCOMES):
                gain_k, gain_j = work[3 + h, k] / variances[h], work[3 + h, j]
                off_k = (outcomes[h, 1] if k == own else state[k]) + gain_k * misses[h] - mean[k]
                off_j = (outcomes[h, 1] if j == own else state[j]) + gain_j / variances[h] * misses[h] - mean[j]
                value += outcomes[h, 0] * (off_k * off_j - gain_k * gain_j)
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
def follow(track, measured, order, end_s, motion, creep, odds, flat):
    """(state, covariance, heard_s, log-likelihood, excess_m, sigma_m) after an epoch's ranges, in an order of times.

    track: state (7 + n,), covariance, time of the state, times (n,) each anchor was last heard. measured: anchors
    (n, 3), of each range the index of its anchor, range, sigma, time, p_sight (m,), and (m, 2) its excess over where
    the others of the epoch meet, with the variance of that (inf = they do not tell). order: (m,) of their times. odds:
    1/s at which an anchor's sight is drawn anew, mean and sigma of a new excess (m), noise and cleared sigma as shares
    of a range's sigma, share of new excesses that are far longer, and their sigma (m); share of outliers among ranges;
    factor on what is new, or an outlier, of a range that meets the others.
    excess_m, sigma_m: of every range against the place at its time, as known at the end.
    """
    state, covariance, heard_s = track[0].copy(), track[1].copy(), track[3].copy()
    anchors, index, ranges, sigmas, times_s, p_sight, by_others = measured
    now_s = track[2]
    size, count = state.shape[0], ranges.shape[0]
    work = np.zeros((3 + OUTCOMES, size))
    outcomes = np.zeros((OUTCOMES, 3))
    log_likelihood = 0.0
    for m in order:
        _predict(state, covariance, times_s[m] - now_s, motion, creep, flat)
        now_s = max(now_s, times_s[m])
        i = index[m]
        since_s = min(max(times_s[m] - heard_s[i], 0.0), FORGOTTEN_S)
        heard_s[i] = times_s[m]
        anew = 1.0 - math.exp(-odds[0] * since_s)
        clearing = anew * min(max(p_sight[m], 0.01), 0.99)
        occluding = anew - clearing
        outcomes[0, 0] = max(1.0 - anew, 0.01)
        outcomes[1, 0], outcomes[1, 1], outcomes[1, 2] = clearing, creep[3], (odds[4] * sigmas[m]) ** 2
        outcomes[2, 0], outcomes[2, 1], outcomes[2, 2] = occluding * (1.0 - odds[5]), odds[1], odds[2] * odds[2]
        outcomes[3, 0], outcomes[3, 1], outcomes[3, 2] = occluding * odds[5], odds[1], odds[6] * odds[6]
        outcomes[OUTLIER, 0] = odds[7]
        meets = by_others[m, 0] ** 2 <= MEETS * MEETS * (by_others[m, 1] + sigmas[m] * sigmas[m])
        told = ranges[m], (odds[3] * sigmas[m]) ** 2, by_others[m, 0], by_others[m, 1], odds[8] if meets else 1.0
        log_likelihood += _weigh(state, covariance, anchors[i], STATES + i, told, outcomes, odds[6], work)
    _predict(state, covariance, end_s - now_s, motion, creep, flat)
    excess, sigma = np.zeros(count), np.zeros(count)
    then = state.copy()
    for m in range(count):
        for axis in range(3):
            then[axis] = state[axis] - (max(end_s, now_s) - times_s[m]) * state[3 + axis]
        distance, east, north, up = _direction(then, anchors[index[m]])
        excess[m] = ranges[m] - distance
        sigma[m] = math.sqrt(
            max(
                east * east * covariance[0, 0]
                + north * north * covariance[1, 1]
                + up * up * covariance[2, 2]
                + 2.0
                * (east * north * covariance[0, 1] + east * up * covariance[0, 2] + north * up * covariance[1, 2]),
                0.0,
            )
        )
    return state, covariance, heard_s, log_likelihood, excess, sigma
