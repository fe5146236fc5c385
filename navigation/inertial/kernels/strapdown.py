"""Strapdown mechanisation in a tangent frame that turns with the body: east, north, up at a fixed origin.

A frame that does not follow the vehicle has no transport rate, and its axes are known without error, so that the
attitude error phi and the psi angle (psi = phi - δθ) are the same here. Coning and sculling are Savage's, of two
samples.
"""

import math
from typing import NamedTuple

import numpy as np

from compiled.options import scalar_kernel

__all__ = ["FORCE", "TURN", "Planet", "cross", "gravity", "matrix_of", "quaternion_of", "rotate", "step", "turned"]

EAST, NORTH, UP = 0, 1, 2
W, X, Y, Z = 0, 1, 2, 3
# rows of readings and of what follows from them
FORCE, TURN = 0, 1


class Planet(NamedTuple):
    """A body and its tangent frame: ellipsoid, normal gravity, turning (3,), centre (3,) and axis (3,) in the frame."""

    semi_major_axis_m: float
    flattening: float
    gravity_equator: float
    gravity_pole: float
    centrifugal_ratio: float
    rate: np.ndarray
    centre: np.ndarray
    axis: np.ndarray


@scalar_kernel
def cross(a, b, out):
    """Fill out (3,) with a × b; out is neither of them."""
    out[EAST] = a[1] * b[2] - a[2] * b[1]
    out[NORTH] = a[2] * b[0] - a[0] * b[2]
    out[UP] = a[0] * b[1] - a[1] * b[0]


@scalar_kernel
def quaternion_of(rotation, out):
    """Fill out (4,), scalar first, with the quaternion of a rotation vector (3,)."""
    x, y, z = rotation[EAST], rotation[NORTH], rotation[UP]
    square = x * x + y * y + z * z
    if square < 1e-8:
        half = 0.5 - square / 48.0
        out[W] = 1.0 - square / 8.0
    else:
        angle = math.sqrt(square)
        half = math.sin(0.5 * angle) / angle
        out[W] = math.cos(0.5 * angle)
    out[X], out[Y], out[Z] = half * x, half * y, half * z


@scalar_kernel
def turned(first, second, out):
    """Fill out (4,) with the unit quaternion first ⊗ second; out is neither of them."""
    out[W] = first[W] * second[W] - first[X] * second[X] - first[Y] * second[Y] - first[Z] * second[Z]
    out[X] = first[W] * second[X] + first[X] * second[W] + first[Y] * second[Z] - first[Z] * second[Y]
    out[Y] = first[W] * second[Y] - first[X] * second[Z] + first[Y] * second[W] + first[Z] * second[X]
    out[Z] = first[W] * second[Z] + first[X] * second[Y] - first[Y] * second[X] + first[Z] * second[W]
    length = math.sqrt(out[W] ** 2 + out[X] ** 2 + out[Y] ** 2 + out[Z] ** 2)
    for i in range(4):
        out[i] /= length


@scalar_kernel
def matrix_of(quaternion, out):
    """Fill out (3, 3) with the matrix that turns vectors of the vehicle into the frame."""
    w, x, y, z = quaternion[W], quaternion[X], quaternion[Y], quaternion[Z]
    out[EAST, EAST] = 1.0 - 2.0 * (y * y + z * z)
    out[EAST, NORTH] = 2.0 * (x * y - w * z)
    out[EAST, UP] = 2.0 * (x * z + w * y)
    out[NORTH, EAST] = 2.0 * (x * y + w * z)
    out[NORTH, NORTH] = 1.0 - 2.0 * (x * x + z * z)
    out[NORTH, UP] = 2.0 * (y * z - w * x)
    out[UP, EAST] = 2.0 * (x * z - w * y)
    out[UP, NORTH] = 2.0 * (y * z + w * x)
    out[UP, UP] = 1.0 - 2.0 * (x * x + y * y)


@scalar_kernel
def rotate(matrix, vector, out):
    """Fill out (3,) with matrix · vector."""
    for i in range(3):
        out[i] = matrix[i, EAST] * vector[EAST] + matrix[i, NORTH] * vector[NORTH] + matrix[i, UP] * vector[UP]


@scalar_kernel
def gravity(planet, position_m, out):
    """Fill out (3,) with normal gravity, centrifugal acceleration included (Somigliana, and a series in the height)."""
    a, f = planet.semi_major_axis_m, planet.flattening
    along, square = 0.0, 0.0
    for i in range(3):
        out[i] = position_m[i] - planet.centre[i]
        along += out[i] * planet.axis[i]
        square += out[i] * out[i]
    across = math.sqrt(max(square - along * along, 0.0))
    # Bowring's latitude: 1e-9 of a degree within 10 km of the ellipsoid
    b = a * (1.0 - f)
    e2, e2_second = f * (2.0 - f), f * (2.0 - f) / (1.0 - f) ** 2
    theta = math.atan2(along * a, across * b)
    latitude = math.atan2(along + e2_second * b * math.sin(theta) ** 3, across - e2 * a * math.cos(theta) ** 3)
    sine, cosine = math.sin(latitude), math.cos(latitude)
    normal = a / math.sqrt(1.0 - e2 * sine * sine)
    height = across * cosine + along * sine - a * a / normal
    ratio = b * planet.gravity_pole / (a * planet.gravity_equator) - 1.0
    ground = planet.gravity_equator * (1.0 + ratio * sine * sine) * normal / a
    slope = 1.0 + f + planet.centrifugal_ratio - 2.0 * f * sine * sine
    down = ground * (1.0 - 2.0 / a * slope * height + 3.0 * height * height / (a * a))
    for i in range(3):
        outward = (out[i] - along * planet.axis[i]) / across if across > 0.0 else 0.0
        out[i] = -down * (cosine * outward + sine * planet.axis[i])


@scalar_kernel
def step(state, specific_force, angular_rate, before, step_s, planet):
    """Advance position, velocity and quaternion by step_s, in place; before (2, 3) are the last step's increments.

    state: (position_m (3,), velocity_m_per_s (3,), quaternion (4,)). specific_force, angular_rate: (3,) of the vehicle,
    mean over the step, corrected. before: change of velocity and of angle, and is left as this step's.
    """
    position_m, velocity, quaternion = state
    speed_before, angle_before = before[FORCE], before[TURN]
    speed, angle = specific_force * step_s, angular_rate * step_s
    part, other = np.empty(3), np.empty(3)
    moved, pull, whirl = np.empty(3), np.empty(3), np.empty(3)
    matrix, rotation, turn = np.empty((3, 3)), np.empty(4), np.empty(4)
    # sculling: the vehicle turns while it is pushed
    cross(angle, speed, part)
    moved[:] = speed + 0.5 * part
    cross(angle_before, speed, part)
    cross(speed_before, angle, other)
    moved += (part + other) / 12.0
    matrix_of(quaternion, matrix)
    rotate(matrix, moved, part)
    gravity(planet, position_m, pull)
    cross(planet.rate, velocity, whirl)
    cross(planet.rate, part, other)
    for i in range(3):
        # the frame turns under the push, by half of its turn on average
        after = velocity[i] + part[i] - 0.5 * step_s * other[i] + (pull[i] - 2.0 * whirl[i]) * step_s
        position_m[i] += 0.5 * step_s * (velocity[i] + after)
        velocity[i] = after
    # coning: axes that turn by turns
    cross(angle_before, angle, part)
    quaternion_of(angle + part / 12.0, rotation)
    turned(quaternion, rotation, turn)
    quaternion_of(-step_s * planet.rate, rotation)
    turned(rotation, turn, quaternion)
    before[FORCE], before[TURN] = speed, angle
