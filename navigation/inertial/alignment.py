"""Attitudes: as angles, and coarse alignment from gravity, the planet's turning, or the course of a moving vehicle."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from ..errors import StateError
from ..inputs import numbers
from .bodies import TangentFrame
from .kernels import strapdown as kernel

__all__ = ["align_moving", "align_still", "angles_of", "matrices_of", "quaternion_of_angles"]

Array = npt.NDArray[np.float64]


def quaternion_of_angles(heading_rad: float, pitch_rad: float = 0.0, roll_rad: float = 0.0) -> Array:
    """(4,) scalar first, that turns vectors of the vehicle (forward, left, up) into east, north, up.

    heading: clockwise from north; pitch: nose up; roll: right side down.
    """
    turns = (
        np.array([0.0, 0.0, math.pi / 2.0 - heading_rad]),
        np.array([0.0, -pitch_rad, 0.0]),
        np.array([roll_rad, 0.0, 0.0]),
    )
    attitude = np.array([1.0, 0.0, 0.0, 0.0])
    for turn in turns:
        part, whole = np.empty(4), np.empty(4)
        kernel.quaternion_of(turn, part)
        kernel.turned(attitude, part, whole)
        attitude = whole
    return attitude


def matrices_of(quaternions: npt.ArrayLike) -> Array:
    """(..., 3, 3) matrices of quaternions (..., 4), scalar first, normalised."""
    q = np.asarray(quaternions, np.float64)
    w, x, y, z = np.moveaxis(q / np.linalg.norm(q, axis=-1, keepdims=True), -1, 0)
    rows = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def angles_of(quaternions: npt.ArrayLike) -> Array:
    """(..., 3) heading, pitch, roll in radians of quaternions (..., 4); heading from 0 to 2π."""
    c = matrices_of(quaternions)
    heading = np.arctan2(c[..., 0, 0], c[..., 1, 0]) % (2.0 * math.pi)
    pitch = np.arcsin(np.clip(c[..., 2, 0], -1.0, 1.0))
    roll = np.arctan2(c[..., 2, 1], c[..., 2, 2])
    return np.stack([heading, pitch, roll], axis=-1)


def align_still(
    force_m_per_s2: npt.ArrayLike,
    rate_rad_per_s: npt.ArrayLike | None = None,
    *,
    heading_rad: float | None = None,
    frame: TangentFrame | None = None,
) -> Array:
    """(4,) attitude of a vehicle that stands still, from its mean readings.

    Gravity levels it. heading_rad turns it, or the planet's own turning does as the gyros feel it (rate and frame):
    that takes gyros far better than the planet's turning times the wanted angle. Raises StateError.
    """
    up = numbers("force_m_per_s2", force_m_per_s2, (3,), StateError)
    pull = float(np.linalg.norm(up))
    if not pull > 0.0:
        raise StateError("Without any force there is no way up to be found.")
    pitch, roll = math.asin(min(max(up[0] / pull, -1.0), 1.0)), math.atan2(up[1], up[2])
    if heading_rad is not None:
        return quaternion_of_angles(heading_rad, pitch, roll)
    if rate_rad_per_s is None or frame is None:
        raise StateError("A still vehicle's heading needs heading_rad, or its turn rate and the frame.")
    felt = numbers("rate_rad_per_s", rate_rad_per_s, (3,), StateError)
    turning = matrices_of(quaternion_of_angles(0.0, pitch, roll)) @ felt
    east, north = float(turning[0]), float(turning[1])
    if not math.hypot(east, north) > 0.2 * abs(frame.body.rate_rad_per_s * math.cos(frame.latitude_rad)):
        raise StateError("The gyros do not feel the planet turn about the horizontal; they cannot tell the heading.")
    # at heading 0 it should turn about north; about the east it turns as far as the vehicle's nose is from there
    return quaternion_of_angles(-math.atan2(east, north) % (2.0 * math.pi), pitch, roll)


def align_moving(
    force_m_per_s2: npt.ArrayLike,
    velocity_m_per_s: npt.ArrayLike,
    acceleration_m_per_s2: npt.ArrayLike = (0.0, 0.0, 0.0),
    *,
    least_speed_m_per_s: float = 1.0,
) -> Array:
    """(4,) attitude of a vehicle that drives along its nose: course for heading, readings less acceleration for level.

    velocity and acceleration: (3,) east, north, up, as fixes tell them. Raises StateError below least_speed_m_per_s.
    """
    east, north, _ = (float(v) for v in numbers("velocity_m_per_s", velocity_m_per_s, (3,), StateError))
    speed = math.hypot(east, north)
    if not speed >= least_speed_m_per_s:
        raise StateError(f"At {speed:.2f} m/s there is no course; align at {least_speed_m_per_s:g} m/s or more.")
    force = numbers("force_m_per_s2", force_m_per_s2, (3,), StateError)
    pushed = numbers("acceleration_m_per_s2", acceleration_m_per_s2, (3,), StateError)
    heading = math.atan2(east, north)
    forward = (pushed[0] * east + pushed[1] * north) / speed
    left = (pushed[1] * east - pushed[0] * north) / speed
    # what would be felt on level ground, but for gravity's own way
    return align_still(force - (forward, left, pushed[2]), heading_rad=heading)
