"""The error state of inertial navigation, corrected by scalars of any kind and fed back at once.

The errors are truth less estimate: position, velocity, psi, biases of accelerometers and gyros, then their scale
factors and the lever arm where these are estimated: 15, 18, 21 or 24 numbers, and two more, a receiver's clock and its
drift, where pseudoranges come in. Errors of a sensor are what its readings
have too much, so that a force is reading - bias - scale·reading.
"""

import math
from typing import NamedTuple

import numpy as np

from compiled.options import scalar_kernel
from navigation.kernels.covariance import joseph
from navigation.kernels.ranges import INNOVATION, LOST, REOPENED, VARIANCE

from .strapdown import FORCE, TURN, cross, matrix_of, quaternion_of, rotate, turned

__all__ = [
    "ACCELEROMETER",
    "ALONG",
    "BACK_IN",
    "COORDINATE",
    "DRIFT",
    "GATED",
    "GYRO",
    "LEFT_OUT",
    "OFFSET",
    "POSITION",
    "PSEUDORANGE",
    "PSI",
    "RANGE",
    "RATE",
    "USED",
    "VELOCITY",
    "Belief",
    "Layout",
    "Noise",
    "correct",
    "expected",
    "grow",
    "linear",
]

EAST, NORTH, UP = 0, 1, 2
POSITION, VELOCITY, PSI, ACCELEROMETER, GYRO = 0, 3, 6, 9, 12
# kinds of measurements: a coordinate along a direction, its rate, a range to a place, a speed along the vehicle, a
# range with the receiver's clock in it
COORDINATE, RATE, RANGE, ALONG, PSEUDORANGE = 0, 1, 2, 3, 4
LEFT_OUT, USED, GATED, BACK_IN = 0, 1, 2, 3
# of a clock
OFFSET, DRIFT = 0, 1


class Layout(NamedTuple):
    """Where scale factors (accelerometers, then gyros), lever arm and clock begin in the error state; -1 = nowhere."""

    scales: int
    lever: int
    clock: int


class Noise(NamedTuple):
    """Densities: of the readings' white noise, of the biases' walk; their decay 1/s; of unknown motion in gaps; of the
    clock's walk and its drift's."""

    force: float
    turn: float
    force_walk: float
    turn_walk: float
    force_decay: float
    turn_decay: float
    gap_force: float
    gap_turn: float
    clock: float
    drift: float


class Belief(NamedTuple):
    """The navigation solution, all in place: sensor errors (4, 3) are biases, then scale factors, as above; clock_m
    (2,) is offset and drift."""

    position_m: np.ndarray
    velocity: np.ndarray
    quaternion: np.ndarray
    sensors: np.ndarray
    lever_m: np.ndarray
    clock_m: np.ndarray
    covariance: np.ndarray
    doubt: np.ndarray


@scalar_kernel
def linear(force, belief, readings, layout, planet, out):
    """Fill out (9, n) with the upper rows of F; below them there are only decays.

    force: (3,) specific force in the frame; readings: (2, 3) of accelerometers and gyros.
    """
    out[:] = 0.0
    matrix = np.empty((3, 3))
    matrix_of(belief.quaternion, matrix)
    pull = planet.gravity_equator / planet.semi_major_axis_m
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        out[POSITION + i, VELOCITY + i] = 1.0
        # the farther off, the weaker and the more turned is gravity
        out[VELOCITY + i, POSITION + i] = 2.0 * pull if i == UP else -pull
        out[VELOCITY + i, VELOCITY + j] = 2.0 * planet.rate[k]
        out[VELOCITY + i, VELOCITY + k] = -2.0 * planet.rate[j]
        out[VELOCITY + i, PSI + j] = force[k]
        out[VELOCITY + i, PSI + k] = -force[j]
        out[PSI + i, PSI + j] = planet.rate[k]
        out[PSI + i, PSI + k] = -planet.rate[j]
        for c in range(3):
            out[VELOCITY + i, ACCELEROMETER + c] = -matrix[i, c]
            out[PSI + i, GYRO + c] = -matrix[i, c]
            if layout.scales >= 0:
                out[VELOCITY + i, layout.scales + c] = -matrix[i, c] * readings[FORCE, c]
                out[PSI + i, layout.scales + 3 + c] = -matrix[i, c] * readings[TURN, c]


@scalar_kernel
def _pass(rows, step_s, noise, layout, table):
    """table (n, m) becomes Φ·table, Φ = I + F·step with the biases' decay."""
    n, m = table.shape
    held = table[:9].copy()
    for i in range(9):
        for j in range(n):
            weight = rows[i, j] * step_s
            if weight != 0.0:
                for c in range(m):
                    held[i, c] += weight * table[j, c]
    table[:9] = held
    for i in range(3):
        for c in range(m):
            table[ACCELEROMETER + i, c] *= math.exp(-noise.force_decay * step_s)
            table[GYRO + i, c] *= math.exp(-noise.turn_decay * step_s)
    if layout.clock >= 0:
        for c in range(m):
            table[layout.clock, c] += step_s * table[layout.clock + 1, c]


@scalar_kernel
def grow(covariance, transition, rows, step_s, noise, layout, gap):
    """Covariance after step_s, in place: Φ·P·Φᵀ + Q; transition (n, n) becomes Φ·transition, (0, 0) = not asked for."""
    n = covariance.shape[0]
    _pass(rows, step_s, noise, layout, covariance)
    turned_over = covariance.T.copy()
    _pass(rows, step_s, noise, layout, turned_over)
    for i in range(n):
        for j in range(i + 1):
            middle = 0.5 * (turned_over[i, j] + turned_over[j, i])
            covariance[i, j] = middle
            covariance[j, i] = middle
    for i in range(3):
        covariance[VELOCITY + i, VELOCITY + i] += step_s * (noise.force**2 + (noise.gap_force**2 if gap else 0.0))
        covariance[PSI + i, PSI + i] += step_s * (noise.turn**2 + (noise.gap_turn**2 if gap else 0.0))
        covariance[ACCELEROMETER + i, ACCELEROMETER + i] += step_s * noise.force_walk**2
        covariance[GYRO + i, GYRO + i] += step_s * noise.turn_walk**2
    if layout.clock >= 0:
        covariance[layout.clock, layout.clock] += step_s * noise.clock**2
        covariance[layout.clock + 1, layout.clock + 1] += step_s * noise.drift**2
    if transition.shape[0] > 0:
        _pass(rows, step_s, noise, layout, transition)


@scalar_kernel
def expected(kind, vectors, belief, turn_rate, layout, row):
    """What a measurement should be; fill row (n,), its derivative by the error state.

    vectors: (vector (3,): direction in the frame for COORDINATE and RATE, place for ranges, direction on the vehicle
    for ALONG; offset (3,) on the vehicle from the antenna to where it is measured). turn_rate: (3,) corrected.
    """
    vector, offset = vectors
    row[:] = 0.0
    matrix, arm, swing, part, direction = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    matrix_of(belief.quaternion, matrix)
    if kind == ALONG:
        # the velocity of the vehicle's own origin along a direction on it; C = (I + psi×)·C of the estimate
        rotate(matrix, vector, direction)
        cross(direction, belief.velocity, part)
        total = 0.0
        for i in range(3):
            row[VELOCITY + i] = direction[i]
            row[PSI + i] = part[i]
            total += direction[i] * belief.velocity[i]
        return total
    lever = belief.lever_m + offset
    cross(turn_rate, lever, part)
    rotate(matrix, lever, arm)
    rotate(matrix, part, swing)
    total, base = 0.0, POSITION
    direction[:] = vector
    if kind in (RANGE, PSEUDORANGE):
        for i in range(3):
            direction[i] = belief.position_m[i] + arm[i] - vector[i]
            total += direction[i] * direction[i]
        total = math.sqrt(total)
        for i in range(3):
            direction[i] = direction[i] / total if total > 0.0 else 0.0
        if kind == PSEUDORANGE:
            total += belief.clock_m[OFFSET]
            if layout.clock >= 0:
                row[layout.clock] = 1.0
    elif kind == COORDINATE:
        for i in range(3):
            total += direction[i] * (belief.position_m[i] + arm[i])
    else:
        base = VELOCITY
        arm[:] = swing
        for i in range(3):
            total += direction[i] * (belief.velocity[i] + arm[i])
    cross(arm, direction, part)
    for i in range(3):
        row[base + i] = direction[i]
        row[PSI + i] = part[i]
    if layout.lever >= 0:
        for c in range(3):
            along = matrix[EAST, c] * direction[EAST] + matrix[NORTH, c] * direction[NORTH]
            part[c] = along + matrix[UP, c] * direction[UP]
        if base == VELOCITY:
            # u·C·(ω×l) = l·((Cᵀu)×ω)
            cross(part, turn_rate, swing)
            part[:] = swing
        for c in range(3):
            row[layout.lever + c] = part[c]
    return total


@scalar_kernel
def _feed_back(belief, layout, gain, innovation, correction):
    """Take gain·innovation into the solution, in place, and add it up in correction (n,)."""
    rotation, turn, before = np.empty(3), np.empty(4), belief.quaternion.copy()
    for i in range(3):
        belief.position_m[i] += gain[POSITION + i] * innovation
        belief.velocity[i] += gain[VELOCITY + i] * innovation
        rotation[i] = gain[PSI + i] * innovation
        for kind in range(4 if layout.scales >= 0 else 2):
            place = ACCELEROMETER + 3 * kind if kind < 2 else layout.scales + 3 * (kind - 2)
            belief.sensors[kind, i] += gain[place + i] * innovation
        if layout.lever >= 0:
            belief.lever_m[i] += gain[layout.lever + i] * innovation
    for i in range(2 if layout.clock >= 0 else 0):
        belief.clock_m[i] += gain[layout.clock + i] * innovation
    quaternion_of(rotation, turn)
    turned(turn, before, belief.quaternion)
    for i in range(correction.shape[0]):
        correction[i] += gain[i] * innovation


@scalar_kernel
def correct(measurement, belief, turn_rate, layout, gate, correction, found):
    """Correct the belief in place by one scalar; found (2,): innovation and its variance; what became of it.

    measurement: (kind, value, variance, vectors as of ``expected``); gate: how many sigmas an innovation may be off. A
    gate that keeps out nearly everything guards a wrong belief, as in ``navigation.kernels.ranges``: then the position
    is widened.
    """
    kind, value, variance, vectors = measurement
    n = belief.covariance.shape[0]
    row, gain = np.empty(n), np.empty(n)
    found[:] = math.nan
    if math.isnan(value) or not variance < math.inf:
        return LEFT_OUT
    innovation = value - expected(kind, vectors, belief, turn_rate, layout, row)
    total = variance
    for i in range(n):
        for j in range(n):
            total += row[i] * belief.covariance[i, j] * row[j]
    verdict = USED
    doubt = belief.doubt
    if innovation * innovation > gate * gate * total:
        if doubt[0] >= 0.0:
            doubt[0] += 1.0
            if doubt[0] < LOST:
                found[INNOVATION], found[VARIANCE] = innovation, total
                return GATED
            for i in range(3):
                belief.covariance[POSITION + i, POSITION + i] += innovation * innovation
                belief.covariance[VELOCITY + i, VELOCITY + i] += innovation * innovation / 100.0
            doubt[0] = -REOPENED
        else:
            variance += innovation * innovation / (gate * gate)
    elif doubt[0] >= 0.0:
        # that one axis of a fix is right says little of a belief that is wrong along another
        doubt[0] = max(doubt[0] - (2.0 if kind in (RANGE, PSEUDORANGE) else 0.25), 0.0)
    if doubt[0] < 0.0:
        doubt[0] += 1.0
        verdict = BACK_IN
    found[INNOVATION] = innovation
    found[VARIANCE] = joseph(belief.covariance, row, variance, gain)
    _feed_back(belief, layout, gain, innovation, correction)
    return verdict
