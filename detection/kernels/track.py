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
from .outcomes import (
    CLEARED,
    FAR,
    GAINS,
    GOES_ON,
    NEW,
    OUTCOMES,
    OUTLIER,
    SHARED,
    STATES,
    E,
    N,
    Told,
    U,
    set_outcome,
    way_from,
    weigh,
)

__all__ = ["SHARED", "STATES", "Belief", "Creep", "Measured", "Odds", "Push", "follow", "pull"]

VELOCITY = 3
CLIMB = 5
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
def pull(state, covariance, direction, measured, variance):
    """Update, in place, with a measured combination of states: direction · state = measured, of a variance."""
    size = state.shape[0]
    # written out: of matrix products numba makes calls of SciPy's, which a rover need not carry
    spread, total, miss = np.zeros(size), variance, measured
    for k in range(size):
        for j in range(size):
            spread[k] += covariance[k, j] * direction[j]
    for k in range(size):
        total += direction[k] * spread[k]
        miss -= direction[k] * state[k]
    for k in range(size):
        state[k] += spread[k] / total * miss
        for j in range(size):
            covariance[k, j] -= spread[k] * spread[j] / total


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
        set_outcome(outcomes, GOES_ON, max(1.0 - anew, 0.01), 0.0, 0.0)
        set_outcome(outcomes, CLEARED, clearing, creep.mean_m, (odds.cleared * sigmas[m]) ** 2)
        set_outcome(outcomes, NEW, occluding * (1.0 - odds.far_share), odds.new_m, odds.new_sigma_m * odds.new_sigma_m)
        set_outcome(outcomes, FAR, occluding * odds.far_share, odds.new_m, odds.far_sigma_m * odds.far_sigma_m)
        set_outcome(outcomes, OUTLIER, odds.outliers, 0.0, 0.0)
        excess_m, variance = by_others[m, EXCESS], by_others[m, EXCESS_VARIANCE]
        meets = excess_m**2 <= MEETS * MEETS * (variance + sigmas[m] * sigmas[m])
        seldom = odds.meeting if meets else 1.0
        told = Told(ranges[m], (odds.noise * sigmas[m]) ** 2, excess_m, variance, seldom, odds.far_sigma_m)
        log_likelihood += weigh(state, covariance, anchors[i], STATES + i, told, outcomes, work)
    _predict(state, covariance, end_s - now_s, push, creep, flat)
    excess, sigma = np.zeros(count), np.zeros(count)
    then = state.copy()
    for m in range(count):
        for axis in range(3):
            then[axis] = state[axis] - (max(end_s, now_s) - times_s[m]) * state[VELOCITY + axis]
        distance, east, north, up = way_from(then, anchors[index[m]])
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
