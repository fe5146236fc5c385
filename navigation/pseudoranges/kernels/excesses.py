"""A vehicle on wheels that takes pseudoranges in, each of which may be too long.

The state is east, north, up, heading (left of east), bias of the turn rate, clock and drift, the offsets of further
systems' clocks, then of each satellite the excess of its pseudorange and the slow part of its error. What is believed
of an excess (in sight: none; the same as before; another one, Exp(mean)) is met by its first two moments.
"""

import math
from typing import NamedTuple

import numpy as np

from compiled.options import scalar_kernel
from navigation.kernels.hypotheses import excess_moments, log_normal

__all__ = ["CLOCK", "HEADING", "OFFSETS", "Belief", "Law", "Pseudoranges", "Wheels", "follow"]

EAST, NORTH, UP, HEADING, TURN_BIAS, CLOCK, DRIFT, OFFSETS = 0, 1, 2, 3, 4, 5, 6, 7
RIGHT, SAME, OTHER = 0, 1, 2
NO_FLOOR = 0.0
# a range that is too short by more sigmas than that pulls as one that is so many too short
TOO_SHORT = 4.0


class Belief(NamedTuple):
    """In place: mean (n,), covariance (n, n), lying (s,) probability that the last range of each satellite lied."""

    mean: np.ndarray
    covariance: np.ndarray
    lying: np.ndarray


class Wheels(NamedTuple):
    """Of each of k epochs, since the one before: seconds (k,), metres along the heading (k,), radians to the left."""

    seconds: np.ndarray
    way_m: np.ndarray
    turn_rad: np.ndarray


class Pseudoranges(NamedTuple):
    """Those of epoch k are first[k] to first[k + 1]: measured (m,), places (m, 3), satellite and system (m,), sigma of
    the slow error (m,), probability of sight (m,)."""

    first: np.ndarray
    measured_m: np.ndarray
    places_m: np.ndarray
    satellite: np.ndarray
    system: np.ndarray
    sigma_m: np.ndarray
    sight: np.ndarray


class Law(NamedTuple):
    """How errors behave: share that lies, mean excess, times that lying, an excess and the slow error last, white
    sigma; densities of wheels along, upwards, of turning, of the turn's bias, of clock and drift."""

    share: float
    mean_m: float
    lasting_s: float
    steady_s: float
    slow_s: float
    white_m: float
    along: float
    upwards: float
    turning: float
    turn_walk: float
    clock: float
    drift: float


@scalar_kernel
def _carry(belief, step_s, way_m, turn_rad, law, slow, errors):
    """The belief after step_s of driving, in place; slow: where slow errors begin; errors: (sigmas (s,) that they
    return to, (s, s) how they correlate)."""
    slow_m, alike = errors
    mean, covariance = belief.mean, belief.covariance
    n = mean.shape[0]
    turned = turn_rad - mean[TURN_BIAS] * step_s
    halfway = mean[HEADING] + 0.5 * turned
    east, north = way_m * math.cos(halfway), way_m * math.sin(halfway)
    mean[EAST] += east
    mean[NORTH] += north
    mean[HEADING] += turned
    mean[CLOCK] += mean[DRIFT] * step_s
    decay = math.exp(-step_s / law.slow_s)
    mean[slow:] *= decay
    half_s = 0.5 * step_s
    for _ in range(2):  # rows, then of the transpose, which gives the columns
        for j in range(n):
            covariance[EAST, j] += -north * covariance[HEADING, j] + half_s * north * covariance[TURN_BIAS, j]
            covariance[NORTH, j] += east * covariance[HEADING, j] - half_s * east * covariance[TURN_BIAS, j]
            covariance[HEADING, j] -= step_s * covariance[TURN_BIAS, j]
            covariance[CLOCK, j] += step_s * covariance[DRIFT, j]
        covariance[slow:] *= decay
        covariance[:] = covariance.T.copy()
    covariance[EAST, EAST] += law.along**2 * step_s
    covariance[NORTH, NORTH] += law.along**2 * step_s
    covariance[UP, UP] += law.upwards**2 * step_s
    covariance[HEADING, HEADING] += law.turning**2 * step_s
    covariance[TURN_BIAS, TURN_BIAS] += law.turn_walk**2 * step_s
    covariance[CLOCK, CLOCK] += law.clock**2 * step_s + law.drift**2 * step_s**3 / 3.0
    covariance[CLOCK, DRIFT] += law.drift**2 * step_s**2 / 2.0
    covariance[DRIFT, CLOCK] = covariance[CLOCK, DRIFT]
    covariance[DRIFT, DRIFT] += law.drift**2 * step_s
    for s in range(slow_m.shape[0]):
        for t in range(slow_m.shape[0]):
            covariance[slow + s, slow + t] += slow_m[s] * slow_m[t] * alike[s, t] * (1.0 - decay * decay)


@scalar_kernel
def _priors(lying, since_s, sight, law, priors):
    """Fill priors (3,) of a range in sight, lying as before, lying by another excess."""
    kept, same = math.exp(-since_s / law.lasting_s), math.exp(-since_s / law.steady_s)
    share = 1.0 - sight * (1.0 - law.share)
    priors[SAME] = lying * same * kept
    priors[OTHER] = lying * ((1.0 - same) * kept + (1.0 - kept) * share) + (1.0 - lying) * (1.0 - kept) * share
    priors[RIGHT] = max(1.0 - priors[SAME] - priors[OTHER], 1e-12)


@scalar_kernel
def _moments(mean, covariance, e, shares, gains, found):
    """Blend the three beliefs into one, in place.

    e: place of the excess. gains: (gain (n,) of a range without excess, its variance, gain with it, its variance).
    found: (innovation without excess, with it, excess of another one, its variance).
    """
    gain, variance, gain_same, variance_same = gains
    innovation, innovation_same, excess, spread = found
    n = mean.shape[0]
    apart = np.empty((3, n))
    for i in range(n):
        apart[RIGHT, i] = gain[i] / variance * innovation
        apart[SAME, i] = gain_same[i] / variance_same * innovation_same
        apart[OTHER, i] = gain[i] / variance * (innovation - excess)
    apart[RIGHT, e], apart[OTHER, e] = -mean[e], excess - mean[e]
    told = (1.0 - spread / variance) / variance
    for i in range(n):
        middle = 0.0
        for branch in range(3):
            middle += shares[branch] * apart[branch, i]
        mean[i] += middle
        for branch in range(3):
            apart[branch, i] -= middle
    for i in range(n):
        for j in range(i + 1):
            same = covariance[i, j] - gain_same[i] * gain_same[j] / variance_same
            if i != e and j != e:
                right = covariance[i, j] - gain[i] * gain[j] / variance
                other = covariance[i, j] - gain[i] * gain[j] * told
            else:
                right = 0.0
                other = spread if i == j else -gain[j if i == e else i] / variance * spread
            total = shares[RIGHT] * right + shares[SAME] * same + shares[OTHER] * other
            for branch in range(3):
                total += shares[branch] * apart[branch, i] * apart[branch, j]
            covariance[i, j] = total
            covariance[j, i] = total


@scalar_kernel
def _take(belief, measured, since_s, law, slow):
    """Take a pseudorange in: (range, place (3,), satellite, system, sight)."""
    range_m, place_m, satellite, system, sight = measured
    mean, covariance, lying = belief
    n = mean.shape[0]
    row, gain, gain_same, shares = np.zeros(n), np.empty(n), np.empty(n), np.empty(3)
    length = 0.0
    for i in range(3):
        row[i] = mean[i] - place_m[i]
        length += row[i] * row[i]
    length = math.sqrt(length)
    for i in range(3):
        row[i] /= length
    expected = length + mean[CLOCK]
    row[CLOCK] = 1.0
    if system > 0:
        row[OFFSETS + system - 1] = 1.0
        expected += mean[OFFSETS + system - 1]
    e = slow - lying.shape[0] + satellite
    row[slow + satellite] = 1.0
    innovation = range_m - expected - mean[slow + satellite]
    variance = law.white_m**2
    for i in range(n):
        gain[i] = 0.0
        for j in range(n):
            gain[i] += covariance[i, j] * row[j]
        gain_same[i] = gain[i] + covariance[i, e]
    for i in range(n):
        variance += row[i] * gain[i]
    if innovation < 0.0:
        variance = max(variance, (innovation / TOO_SHORT) ** 2)
    variance_same = variance + covariance[e, e] + 2.0 * gain[e]
    innovation_same = innovation - mean[e]
    _priors(lying[satellite], since_s, sight, law, shares)
    likelihood, excess, spread = excess_moments(innovation, variance, (NO_FLOOR, law.mean_m))
    shares[RIGHT] = math.log(shares[RIGHT]) + log_normal(innovation, variance)
    shares[SAME] = math.log(max(shares[SAME], 1e-300)) + log_normal(innovation_same, variance_same)
    shares[OTHER] = math.log(max(shares[OTHER], 1e-300)) + likelihood
    top, total = shares.max(), 0.0
    for branch in range(3):
        shares[branch] = math.exp(shares[branch] - top)
        total += shares[branch]
    shares /= total
    lying[satellite] = 1.0 - shares[RIGHT]
    gains = gain, variance, gain_same, variance_same
    _moments(mean, covariance, e, shares, gains, (innovation, innovation_same, excess, spread))


@scalar_kernel
def follow(belief, wheels, ranges, law, alike, means, covariances, lying):
    """Drive through k epochs; fill means (k, 7 + o), covariances (k, 3, 3) of the place and lying (m,).

    alike: (s, s) how the satellites' slow errors correlate.
    """
    satellites = belief.lying.shape[0]
    slow = belief.mean.shape[0] - satellites
    slow_m, heard_s = np.zeros(satellites), np.full(satellites, -1e9)
    for s in range(satellites):
        slow_m[s] = math.sqrt(belief.covariance[slow + s, slow + s])
    now_s = 0.0
    for k in range(wheels.seconds.shape[0]):
        if wheels.seconds[k] > 0.0:
            now_s += wheels.seconds[k]
            _carry(belief, wheels.seconds[k], wheels.way_m[k], wheels.turn_rad[k], law, slow, (slow_m, alike))
        for r in range(ranges.first[k], ranges.first[k + 1]):
            s = ranges.satellite[r]
            slow_m[s] = ranges.sigma_m[r]
            measured = ranges.measured_m[r], ranges.places_m[r], s, ranges.system[r], ranges.sight[r]
            _take(belief, measured, now_s - heard_s[s], law, slow)
            heard_s[s] = now_s
            lying[r] = belief.lying[s]
        means[k] = belief.mean[: means.shape[1]]
        covariances[k] = belief.covariance[:3, :3]
