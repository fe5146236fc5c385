"""Planes through points: principal components, and what quantisation alone would leave."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError
from ..inputs import positions
from .depth_sensor import DepthSensor

__all__ = ["PlaneFit", "fit_plane", "quantisation_sigma_m"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PlaneFit:
    """The plane normal·p = distance_m, normal (3,) of unit length towards the sensor at the origin.

    sigma_m, largest_m: of the points' distances from it. covariance: (3, 3) of two turns of the normal, radians, about
    the plane's longest and second axis, and of the distance of the points' centre, from sigma_m.
    """

    normal: Array
    distance_m: float
    centre_m: Array
    axes: Array
    sigma_m: float
    largest_m: float
    covariance: Array
    points: int


def fit_plane(points_m: npt.ArrayLike) -> PlaneFit:
    """The plane with the least squares of distances, by principal components (seed 002, section 6.4).

    points_m: (n, 3). Raises MeasurementError for fewer than four points, and where they lie on a line.
    """
    points = positions("points_m", points_m)
    if len(points) < 4:
        raise MeasurementError(f"A plane and its spread need four points at least, not {len(points)}.")
    centre = points.mean(axis=0)
    _, spreads, axes = np.linalg.svd(points - centre, full_matrices=False)
    if not spreads[1] > 1e-9 * max(spreads[0], 1e-300):
        raise MeasurementError("The points lie on one line, through which many planes go.")
    normal = axes[2] if axes[2] @ centre <= 0.0 else -axes[2]
    off = (points - centre) @ normal
    sigma = math.sqrt(float(off @ off) / (len(points) - 3))
    # a turn about the longest axis moves points by how far they lie along the second
    variances = sigma**2 * np.array([spreads[1] ** -2, spreads[0] ** -2, 1.0 / len(points)])
    return PlaneFit(
        normal,
        float(normal @ centre),
        centre,
        axes[:2].copy(),
        sigma,
        float(np.abs(off).max()),
        np.diag(variances),
        len(points),
    )


def quantisation_sigma_m(sensor: DepthSensor, plane: PlaneFit) -> float:
    """Sigma of distances from a plane that comes from rounding alone, at the points' centre: step·z²/√12 across it.

    Right where a plane is inclined so that it crosses several numbers; one that faces the sensor may lie between two.
    """
    depth_m = float(plane.centre_m[2])
    ray = plane.centre_m / depth_m
    return float(sensor.step_m(depth_m)) / math.sqrt(12.0) * abs(float(ray @ plane.normal))
