"""Scalars of any kind that correct an inertial solution: what each should be, and what becomes of it.

A change of carrier phase is that of a range since the epoch before, whose place, attitude and clock are kept with their
errors (stochastic cloning; Roumeliotis and Burdick 2002), so that what both ends have in common cancels.
"""

import math

import numpy as np

from compiled.options import scalar_kernel
from navigation.kernels.covariance import joseph
from navigation.kernels.ranges import INNOVATION, LOST, REOPENED, VARIANCE

from .error_state import ACCELEROMETER, DRIFT, KEPT_CLOCK, KEPT_PSI, OFFSET, POSITION, PSI, VELOCITY
from .strapdown import cross, matrix_of, quaternion_of, rotate, turned

__all__ = [
    "ALONG",
    "BACK_IN",
    "COORDINATE",
    "GATED",
    "LEFT_OUT",
    "PHASE_CHANGE",
    "PSEUDORANGE",
    "RANGE",
    "RATE",
    "USED",
    "correct",
    "expected",
]

EAST, NORTH, UP = 0, 1, 2
# kinds of measurements: a coordinate along a direction, its rate, a range to a place, a speed along the vehicle, a
# range with the receiver's clock in it, how that has changed since the phases' epoch before
COORDINATE, RATE, RANGE, ALONG, PSEUDORANGE, PHASE_CHANGE = 0, 1, 2, 3, 4, 5
LEFT_OUT, USED, GATED, BACK_IN = 0, 1, 2, 3
# derivatives of a range
BY_PLACE, BY_PSI, BY_LEVER = 0, 1, 2


@scalar_kernel
def _range(place_m, quaternion, lever, to_m, by):
    """From a place to the antenna of a unit there, metres; fill by (3, 3): its derivatives."""
    matrix, arm = np.empty((3, 3)), np.empty(3)
    matrix_of(quaternion, matrix)
    rotate(matrix, lever, arm)
    total = 0.0
    for i in range(3):
        by[BY_PLACE, i] = place_m[i] + arm[i] - to_m[i]
        total += by[BY_PLACE, i] ** 2
    total = math.sqrt(total)
    for i in range(3):
        by[BY_PLACE, i] = by[BY_PLACE, i] / total if total > 0.0 else 0.0
    cross(arm, by[BY_PLACE], by[BY_PSI])
    for c in range(3):
        along = matrix[EAST, c] * by[BY_PLACE, EAST] + matrix[NORTH, c] * by[BY_PLACE, NORTH]
        by[BY_LEVER, c] = along + matrix[UP, c] * by[BY_PLACE, UP]
    return total


@scalar_kernel
def _length(kind, vectors, belief, layout, row):
    """A range, a pseudorange or its change; fill row (n,). vectors: as of ``expected``."""
    vector, offset, late_s = vectors
    by = np.empty((3, 3))
    place_m = belief.position_m - late_s * belief.velocity
    lever = belief.lever_m.copy() if kind == PHASE_CHANGE else belief.lever_m + offset
    total = _range(place_m, belief.quaternion, lever, vector, by)
    for i in range(3):
        row[POSITION + i] = by[BY_PLACE, i]
        row[VELOCITY + i] = -late_s * by[BY_PLACE, i]
        row[PSI + i] = by[BY_PSI, i]
        if layout.lever >= 0:
            row[layout.lever + i] = by[BY_LEVER, i]
    if kind == RANGE:
        return total
    total += belief.clock_m[OFFSET] - late_s * belief.clock_m[DRIFT]
    if layout.clock >= 0:
        row[layout.clock] = 1.0
        row[layout.clock + 1] = -late_s
    if kind == PSEUDORANGE or layout.kept < 0:
        return total
    total -= _range(belief.kept_m, belief.kept_quaternion, lever, offset, by) + belief.kept_clock_m[OFFSET]
    for i in range(3):
        row[layout.kept + i] = -by[BY_PLACE, i]
        row[layout.kept + KEPT_PSI + i] = -by[BY_PSI, i]
        if layout.lever >= 0:
            row[layout.lever + i] -= by[BY_LEVER, i]
    row[layout.kept + KEPT_CLOCK] = -1.0
    return total


@scalar_kernel
def expected(kind, vectors, belief, turn_rate, layout, row):
    """What a measurement should be; fill row (n,), its derivative by the error state.

    vectors: (vector (3,): direction in the frame for COORDINATE and RATE, place for ranges, direction on the vehicle
    for ALONG; offset (3,) on the vehicle from the antenna to where it is measured, of PHASE_CHANGE the satellite's
    place at the epoch before; how many seconds ago). turn_rate: (3,) corrected.
    """
    row[:] = 0.0
    if kind in (RANGE, PSEUDORANGE, PHASE_CHANGE):
        return _length(kind, vectors, belief, layout, row)
    vector, offset, late_s = vectors
    matrix, arm, swing, part, direction = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    matrix_of(belief.quaternion, matrix)
    total = 0.0
    if kind == ALONG:
        # the velocity of the vehicle's own origin along a direction on it; C = (I + psi×)·C of the estimate
        rotate(matrix, vector, direction)
        cross(direction, belief.velocity, part)
        for i in range(3):
            row[VELOCITY + i] = direction[i]
            row[PSI + i] = part[i]
            total += direction[i] * belief.velocity[i]
        return total
    lever = belief.lever_m + offset
    cross(turn_rate, lever, swing)
    direction[:] = vector
    base = POSITION if kind == COORDINATE else VELOCITY
    rotate(matrix, lever if kind == COORDINATE else swing, arm)
    for i in range(3):
        if kind == COORDINATE:
            total += direction[i] * (belief.position_m[i] - late_s * belief.velocity[i] + arm[i])
            row[VELOCITY + i] = -late_s * direction[i]
        else:
            total += direction[i] * (belief.velocity[i] + arm[i])
        row[base + i] = direction[i]
    cross(arm, direction, part)
    for i in range(3):
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
def _turn(rotation, quaternion):
    """Turn a quaternion, in place."""
    turn, before = np.empty(4), quaternion.copy()
    quaternion_of(rotation, turn)
    turned(turn, before, quaternion)


@scalar_kernel
def _feed_back(belief, layout, gain, innovation, correction):
    """Take gain·innovation into the solution, in place, and add it up in correction (n,)."""
    rotation = np.empty(3)
    for i in range(3):
        belief.position_m[i] += gain[POSITION + i] * innovation
        belief.velocity[i] += gain[VELOCITY + i] * innovation
        rotation[i] = gain[PSI + i] * innovation
        for kind in range(4 if layout.scales >= 0 else 2):
            place = ACCELEROMETER + 3 * kind if kind < 2 else layout.scales + 3 * (kind - 2)
            belief.sensors[kind, i] += gain[place + i] * innovation
        if layout.lever >= 0:
            belief.lever_m[i] += gain[layout.lever + i] * innovation
    _turn(rotation, belief.quaternion)
    for i in range(2 if layout.clock >= 0 else 0):
        belief.clock_m[i] += gain[layout.clock + i] * innovation
    if layout.kept >= 0:
        for i in range(3):
            belief.kept_m[i] += gain[layout.kept + i] * innovation
            rotation[i] = gain[layout.kept + KEPT_PSI + i] * innovation
        _turn(rotation, belief.kept_quaternion)
        belief.kept_clock_m[OFFSET] += gain[layout.kept + KEPT_CLOCK] * innovation
    for i in range(correction.shape[0]):
        correction[i] += gain[i] * innovation


@scalar_kernel
def correct(measurement, belief, turn_rate, layout, gate, correction, found):
    """Correct the belief in place by one scalar; found (2,): innovation and its variance; what became of it.

    measurement: (kind, value, variance, vectors as of ``expected``); gate: how many sigmas an innovation may be off. A
    gate that keeps out nearly everything guards a wrong belief, as in ``navigation.kernels.ranges``: then the position
    is widened. A change of phase neither doubts nor confirms a place.
    """
    kind, value, variance, vectors = measurement
    n = belief.covariance.shape[0]
    row, gain = np.empty(n), np.empty(n)
    found[:] = math.nan
    if math.isnan(value) or not variance < math.inf:
        return LEFT_OUT
    innovation = value - expected(kind, vectors, belief, turn_rate, layout, row)
    if math.isnan(innovation):  # the change of a phase of which no epoch before is kept
        return LEFT_OUT
    total = variance
    for i in range(n):
        for j in range(n):
            total += row[i] * belief.covariance[i, j] * row[j]
    verdict = USED
    doubt = belief.doubt
    if innovation * innovation > gate * gate * total:
        if kind == PHASE_CHANGE:  # whole cycles were lost, which says nothing of the belief
            found[INNOVATION], found[VARIANCE] = innovation, total
            return GATED
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
    elif doubt[0] >= 0.0 and kind != PHASE_CHANGE:
        # that one axis of a fix is right says little of a belief that is wrong along another
        doubt[0] = max(doubt[0] - (2.0 if kind in (RANGE, PSEUDORANGE) else 0.25), 0.0)
    if doubt[0] < 0.0 and kind != PHASE_CHANGE:
        doubt[0] += 1.0
        verdict = BACK_IN
    found[INNOVATION] = innovation
    found[VARIANCE] = joseph(belief.covariance, row, variance, gain)
    _feed_back(belief, layout, gain, innovation, correction)
    return verdict
