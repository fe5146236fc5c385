"""The error state of inertial navigation and how it grows.

The errors are truth less estimate: position, velocity, psi, biases of accelerometers and gyros, then their scale
factors and the lever arm where these are estimated: 15, 18, 21 or 24 numbers, and two more, a receiver's clock and its
drift, where pseudoranges come in. Where carrier phases do, seven more are kept of the epoch before: what position, psi
and clock were off by then. Errors of a sensor are what its readings have too much, so that a force is
reading - bias - scale·reading.
"""

import math
from typing import NamedTuple

import numpy as np

from compiled.options import scalar_kernel

from .strapdown import FORCE, TURN, matrix_of

__all__ = [
    "ACCELEROMETER",
    "DRIFT",
    "GYRO",
    "KEPT",
    "OFFSET",
    "POSITION",
    "PSI",
    "VELOCITY",
    "Belief",
    "Layout",
    "Noise",
    "grow",
    "keep",
    "linear",
]

EAST, NORTH, UP = 0, 1, 2
POSITION, VELOCITY, PSI, ACCELEROMETER, GYRO = 0, 3, 6, 9, 12
# of a clock
OFFSET, DRIFT = 0, 1
# how many states are kept of an epoch, and where psi and the clock are among them
KEPT, KEPT_PSI, KEPT_CLOCK = 7, 3, 6


class Layout(NamedTuple):
    """Where scale factors (accelerometers, then gyros), lever arm, clock and what is kept of the phases' epoch before
    begin in the error state; -1 = nowhere."""

    scales: int
    lever: int
    clock: int
    kept: int


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
    (2,) is offset and drift. kept_*: place (3,), quaternion (4,), clock (1,) at the phases' epoch before, NaN: none."""

    position_m: np.ndarray
    velocity: np.ndarray
    quaternion: np.ndarray
    sensors: np.ndarray
    lever_m: np.ndarray
    clock_m: np.ndarray
    kept_m: np.ndarray
    kept_quaternion: np.ndarray
    kept_clock_m: np.ndarray
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
def _copy_rows(table, layout, late_s):
    """Rows of what is kept, in place, from those of what it is kept of."""
    clock = layout.clock
    for c in range(table.shape[1]):
        for i in range(3):
            table[layout.kept + i, c] = table[POSITION + i, c] - late_s * table[VELOCITY + i, c]
            table[layout.kept + KEPT_PSI + i, c] = table[PSI + i, c]
        table[layout.kept + KEPT_CLOCK, c] = table[clock, c] - late_s * table[clock + 1, c]


@scalar_kernel
def keep(belief, transition, layout, late_s):
    """Keep position, attitude and clock of late_s ago, in place: their errors are from now on those of that instant.

    transition (n, n) becomes that of the copying times itself, (0, 0) = not asked for.
    """
    belief.kept_m[:] = belief.position_m - late_s * belief.velocity
    belief.kept_quaternion[:] = belief.quaternion
    belief.kept_clock_m[OFFSET] = belief.clock_m[OFFSET] - late_s * belief.clock_m[DRIFT]
    _copy_rows(belief.covariance, layout, late_s)
    turned_over = belief.covariance.T.copy()
    _copy_rows(turned_over, layout, late_s)
    belief.covariance[:] = turned_over
    if transition.shape[0] > 0:
        _copy_rows(transition, layout, late_s)
