"""A whole log of inertial readings with measurements between them."""

import math
from typing import NamedTuple

import numpy as np

from compiled.options import scalar_kernel

from .corrections import PHASE_CHANGE, correct
from .error_state import DRIFT, OFFSET, grow, keep, linear
from .strapdown import FORCE, TURN, matrix_of, rotate, step

__all__ = ["Events", "Readings", "Stages", "Track", "filter_log"]

# place among the settings
LAYOUT = 0


class Readings(NamedTuple):
    """Times (k,), specific forces and angular rates (k, 3), each the mean since the reading before; gaps (k,) bool."""

    times_s: np.ndarray
    forces: np.ndarray
    rates: np.ndarray
    gaps: np.ndarray


class Events(NamedTuple):
    """Scalar measurements in order of time: (m,), vectors and offsets from the antenna (m, 3)."""

    times_s: np.ndarray
    kinds: np.ndarray
    values: np.ndarray
    variances: np.ndarray
    vectors: np.ndarray
    offsets: np.ndarray
    gates: np.ndarray


class Track(NamedTuple):
    """What is kept after each reading: positions, velocities (k, 3), quaternions (k, 4), sensors (k, 4, 3), sigmas
    (k, n), the position's covariance (k, 3, 3), and the clock (k, 2)."""

    positions: np.ndarray
    velocities: np.ndarray
    quaternions: np.ndarray
    sensors: np.ndarray
    sigmas: np.ndarray
    covariances: np.ndarray
    clocks: np.ndarray


class Stages(NamedTuple):
    """What a smoother needs of each of s readings with events; empty where nobody smooths.

    Φ since the stage before (s, n, n), P before and after its corrections, their sum (s, n), the reading's number (s,).
    """

    transitions: np.ndarray
    before: np.ndarray
    after: np.ndarray
    corrections: np.ndarray
    readings: np.ndarray


@scalar_kernel
def _advance(belief, reading, before, step_s, settings, gap, transition):
    """Advance by part of a reading's step; reading: (2, 3). Returns the vehicle's turn rate, corrected."""
    layout, noise, planet = settings
    used = np.empty((2, 3))
    for kind in range(2):
        for i in range(3):
            raw = reading[kind, i]
            used[kind, i] = raw - belief.sensors[kind, i] - belief.sensors[2 + kind, i] * raw
    rows = np.empty((9, belief.covariance.shape[0]))
    matrix, force = np.empty((3, 3)), np.empty(3)
    matrix_of(belief.quaternion, matrix)
    rotate(matrix, used[FORCE], force)
    linear(force, belief, reading, layout, planet, rows)
    grow(belief.covariance, transition, rows, step_s, noise, layout, gap)
    belief.clock_m[OFFSET] += step_s * belief.clock_m[DRIFT]
    step((belief.position_m, belief.velocity, belief.quaternion), used[FORCE], used[TURN], before, step_s, planet)
    for i in range(3):
        belief.sensors[FORCE, i] *= math.exp(-noise.force_decay * step_s)
        belief.sensors[TURN, i] *= math.exp(-noise.turn_decay * step_s)
    return used[TURN]


@scalar_kernel
def filter_log(readings, events, belief, settings, track, stages, found, verdicts):
    """Navigate through k readings; the belief is that of the first reading's time and ends as the last one.

    settings: (Layout, Noise, Planet). found: (m, 2) innovation and variance, verdicts: (m,) of the events. Those of
    the first instant come before any step; later ones at their own time within a reading's step, or for a smoother at
    its end, as what was so long before. After the changes of phase of an instant its state is kept for the next ones.
    """
    layout = settings[LAYOUT]
    n = belief.covariance.shape[0]
    smooth = stages.readings.shape[0] > 0
    reading, before, rate = np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(3)
    correction = np.zeros(n)
    transition = np.eye(n) if smooth else np.zeros((0, 0))
    e, stage = 0, 0
    for k in range(readings.times_s.shape[0]):
        now_s = readings.times_s[max(k - 1, 0)]
        reading[FORCE], reading[TURN] = readings.forces[k], readings.rates[k]
        first = e
        correction[:] = 0.0
        kept_s = -1.0
        while now_s < readings.times_s[k] or k == 0:
            until_s = readings.times_s[k]
            if not smooth and e < events.times_s.shape[0] and events.times_s[e] < until_s:
                until_s = max(events.times_s[e], now_s)
            if until_s > now_s:
                # what came before counts in proportion: increments of a part of the step are a part of them
                share = (until_s - now_s) / (readings.times_s[k] - readings.times_s[k - 1])
                before *= share
                rate[:] = _advance(belief, reading, before, until_s - now_s, settings, readings.gaps[k], transition)
                before /= share
                now_s = until_s
            if smooth and e < events.times_s.shape[0] and events.times_s[e] <= now_s:
                stages.before[stage] = belief.covariance
            kept_s = -1.0
            while e < events.times_s.shape[0] and events.times_s[e] <= now_s:
                vectors = events.vectors[e], events.offsets[e], now_s - events.times_s[e]
                measurement = events.kinds[e], events.values[e], events.variances[e], vectors
                verdicts[e] = correct(measurement, belief, rate, layout, events.gates[e], correction, found[e])
                if events.kinds[e] == PHASE_CHANGE:
                    kept_s = now_s - events.times_s[e]
                e += 1
            if not smooth and kept_s >= 0.0:
                keep(belief, transition, layout, kept_s)
            if k == 0:
                break
        if smooth and e > first:
            stages.transitions[stage], stages.after[stage] = transition, belief.covariance
            stages.corrections[stage], stages.readings[stage] = correction, k
            transition[:] = np.eye(n)
            stage += 1
            if kept_s >= 0.0:
                keep(belief, transition, layout, kept_s)
        track.positions[k] = belief.position_m
        track.velocities[k] = belief.velocity
        track.quaternions[k] = belief.quaternion
        track.sensors[k] = belief.sensors
        track.clocks[k] = belief.clock_m
        for i in range(n):
            track.sigmas[k, i] = math.sqrt(max(belief.covariance[i, i], 0.0))
        for i in range(3):
            for j in range(3):
                track.covariances[k, i, j] = belief.covariance[i, j]
