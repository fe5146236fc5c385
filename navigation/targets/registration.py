"""From several balls whose places are known to the sensor's own pose, and on to an inertial filter."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError
from ..inertial import Measurements, coordinates, join
from ..inputs import check_covariance, numbers, positions

__all__ = ["TargetPose", "pose_measurements", "register_targets"]

Array = npt.NDArray[np.float64]
MOST_STEPS = 50


@dataclass(frozen=True, eq=False)
class TargetPose:
    """Where the sensor is in the frame of the targets.

    position_m: (3,); R_sensor_to_targets: (3, 3) turns right, down, forward into that frame. covariance: (6, 6) of the
    position and of small turns about the frame's axes, radians. misfit: chi-square of the residuals over their degrees
    of freedom, about 1 where the covariances given were right; NaN with none. residuals_m: (n, 3).
    """

    position_m: Array
    R_sensor_to_targets: Array
    covariance: Array
    misfit: float
    residuals_m: Array


def register_targets(
    seen_m: npt.ArrayLike, covariances_m2: npt.ArrayLike, placed_m: npt.ArrayLike, *, placed_sigma_m: float = 0.0
) -> TargetPose:
    """The pose in which balls seen at (n, 3) right, down, forward are those placed at (n, 3), weighed by covariances.

    covariances_m2: (n, 3, 3) of the centres seen. Placed after a survey, the pose is one on the map; placed where the
    balls were seen from an earlier pose, it is the way from there. Raises MeasurementError for fewer than three, or
    where they stand on one line; StateError for a covariance that is none.
    """
    seen, placed = positions("seen_m", seen_m), positions("placed_m", placed_m)
    if len(seen) != len(placed) or len(seen) < 3:
        raise MeasurementError(f"A pose needs three balls or more, seen and placed, not {len(seen)} and {len(placed)}.")
    if not 0.0 <= placed_sigma_m < math.inf:
        raise MeasurementError("placed_sigma_m must be zero or more.")
    spreads = numbers("covariances_m2", covariances_m2, (len(seen), 3, 3))
    for number, spread in enumerate(spreads):
        check_covariance(f"The covariance of ball {number}", spread)
    about_seen, about_placed = seen - seen.mean(axis=0), placed - placed.mean(axis=0)
    for name, about in (("seen", about_seen), ("placed", about_placed)):
        wide = np.linalg.svd(about, compute_uv=False)
        if not wide[1] > 1e-6 * wide[0]:
            raise MeasurementError(f"The balls {name} stand on one line, about which the pose may turn.")
    left, _, right = np.linalg.svd(about_placed.T @ about_seen)
    R_found = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    position = placed.mean(axis=0) - R_found @ seen.mean(axis=0)
    for _ in range(MOST_STEPS):
        turned = seen @ R_found.T
        weights = np.linalg.inv(R_found @ spreads @ R_found.T + placed_sigma_m**2 * np.eye(3))
        off = placed - position - turned
        rows = np.zeros((len(seen), 3, 6))
        rows[:, :, :3] = np.eye(3)
        rows[:, :, 3:] = -_cross(turned)
        information = np.einsum("nri,nrs,nsj->ij", rows, weights, rows)
        step = np.linalg.solve(information, np.einsum("nri,nrs,ns->i", rows, weights, off))
        position, R_found = position + step[:3], _turn(step[3:]) @ R_found
        if float(np.abs(step).max()) < 1e-12 * max(1.0, float(np.abs(position).max())):
            break
    off = placed - position - seen @ R_found.T
    freedom = 3 * len(seen) - 6
    chi_square = float(np.einsum("nr,nrs,ns->", off, weights, off))
    misfit = chi_square / freedom if freedom else math.nan
    return TargetPose(position, R_found, np.linalg.inv(information), misfit, off)


def pose_measurements(
    time_s: float, pose: TargetPose, *, arm_m: npt.ArrayLike = (0.0, 0.0, 0.0), gate_sigma: float = math.inf
) -> Measurements:
    """The pose's position for ``navigation.inertial``, where the frame of the targets is the filter's east, north, up.

    arm_m: (3,) from the sensor to the filter's antenna, right, down, forward. Correlated axes become three independent
    coordinates along the axes of their ellipsoid. Raises MeasurementError.
    """
    arm = pose.R_sensor_to_targets @ numbers("arm_m", arm_m, (3,))
    carried = np.hstack([np.eye(3), -_cross(arm)])
    variances, axes = np.linalg.eigh(carried @ pose.covariance @ carried.T)
    place = pose.position_m + arm
    sigmas = np.sqrt(np.maximum(variances, 1e-12))
    along = [
        coordinates([time_s], [float(axis @ place)], [axis], [sigma], gate_sigma=gate_sigma)
        for axis, sigma in zip(axes.T, sigmas, strict=True)
    ]
    return join(*along)


def _cross(vectors: Array) -> Array:
    """(..., 3, 3) matrices that cross vectors (..., 3) with others."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    zero = np.zeros_like(x)
    rows = [np.stack(row, axis=-1) for row in ((zero, -z, y), (z, zero, -x), (-y, x, zero))]
    return np.stack(rows, axis=-2)


def _turn(rotation: Array) -> Array:
    """(3, 3) of a rotation vector."""
    angle = float(np.linalg.norm(rotation))
    if angle < 1e-15:
        return np.eye(3)
    across = _cross(rotation / angle)
    turned: Array = np.eye(3) + math.sin(angle) * across + (1.0 - math.cos(angle)) * across @ across
    return turned
