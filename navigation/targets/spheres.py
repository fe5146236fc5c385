"""Spheres through points and through the pixels of a depth image: algebraic, geometric, aware of the sensor's steps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError
from ..inputs import positions
from .depth_sensor import DepthSensor, TargetPixels
from .kernels import spheres as kernel
from .planes import fit_plane

__all__ = ["Limb", "SphereFit", "fit_sphere", "fit_sphere_algebraic", "fit_sphere_in_image"]

Array = npt.NDArray[np.float64]
LEAST_POINTS = 12
AS_PLANE = 1.5  # a ball leaves a plane's residuals by more than this factor above its own
MOST_STEPS = 60
SLIGHT_GAIN = 1e-3  # of log-likelihood: a hundredth of what half a sigma changes


@dataclass(frozen=True)
class Limb:
    """What is believed of a ball's outline, pixels: its blur, and how far inside of it depths are not used.

    blur_px 0 = the outline says nothing.
    """

    blur_px: float = 0.5
    margin_px: float = 1.0

    def __post_init__(self) -> None:
        if not (0.0 <= self.blur_px < math.inf and 0.0 <= self.margin_px < math.inf):
            raise MeasurementError("blur_px and margin_px must be zero or more.")


@dataclass(frozen=True, eq=False)
class SphereFit:
    """A ball: centre_m (3,) in the points' frame, radius_m, covariance (4, 4) of both, sigma_m of distances from it."""

    centre_m: Array
    radius_m: float
    covariance: Array
    sigma_m: float
    points: int

    @property
    def radius_sigma_m(self) -> float:
        """One sigma of the radius."""
        return math.sqrt(float(self.covariance[3, 3]))


def fit_sphere_algebraic(points_m: npt.ArrayLike) -> SphereFit:
    """The common fit, linear in centre and r² - |c|²; biased where little of the ball is seen, or noise is large.

    Raises MeasurementError for fewer than 12 points, and for a plane.
    """
    points = _points(points_m)
    ball = _algebraic(points)
    return _judged(points, ball)


def fit_sphere(points_m: npt.ArrayLike) -> SphereFit:
    """The sphere with the least squares of distances (Gauss-Newton from the algebraic one). Raises as that."""
    points = _points(points_m)
    ball = _algebraic(points)
    for _ in range(MOST_STEPS):
        rows, off = _distances(points, ball)
        step = np.linalg.lstsq(rows, -off, rcond=None)[0]
        ball = ball + step
        if float(np.abs(step).max()) < 1e-10 * float(np.abs(ball).max()):
            break
    return _judged(points, ball)


def fit_sphere_in_image(pixels: TargetPixels, sensor: DepthSensor, limb: Limb | None = None) -> SphereFit:
    """The likeliest sphere where each depth is known to be rounded, and the outline to be the ball's (limb).

    Each number d of the sensor says that what it would have measured lies within d ± ½, with its noise; each pixel of
    the target, and each around it, on which side of the outline it lies. limb: None takes Limb(). Fisher's scoring from
    the geometric fit, the noise at first as wide as a step. Raises MeasurementError as the others, where the numbers
    are those of a plane but for their rounding, and where it finds no ball in front of the sensor.
    """
    limb = limb or Limb()
    points = _points(pixels.points_m(sensor))
    _check_no_plane(pixels, sensor)
    start = fit_sphere(points)
    ball = np.append(start.centre_m, start.radius_m)
    observed = _observed(pixels, sensor, limb)
    score, information = np.zeros(4), np.zeros((4, 4))
    for noise in (0.7, 0.35, 0.0):
        spread = _spread(sensor, limb, max(noise, sensor.noise_steps))
        ball = _climb(observed, ball, spread)
    kernel.sphere_likelihood(observed, ball, spread, score, information)
    if not (ball[3] > 0.0 and ball[2] > ball[3]):
        raise MeasurementError("No ball in front of the sensor fits these pixels.")
    off = _distances(points, ball)[1]
    sigma = math.sqrt(float(off @ off) / (len(points) - 4))
    covariance = np.linalg.inv(information).astype(np.float64)
    return SphereFit(ball[:3].copy(), float(ball[3]), covariance, sigma, len(points))


def _climb(observed: kernel.Pixels, ball: Array, spread: kernel.Spread) -> Array:
    """The ball of the greatest likelihood from there on; steps are halved until they climb."""
    score, information, tried = np.zeros(4), np.zeros((4, 4)), np.zeros(4)
    best = kernel.sphere_likelihood(observed, ball, spread, score, information)
    unused = np.zeros((4, 4))
    for _ in range(MOST_STEPS):
        step = np.linalg.lstsq(information, score, rcond=None)[0]
        for _ in range(8):
            following = ball + step
            if following[3] > 0.0 and following[:3] @ following[:3] > following[3] ** 2:
                likelihood = kernel.sphere_likelihood(observed, following, spread, tried, unused)
                if likelihood > best:
                    break
            step = 0.5 * step
        else:
            return ball
        gain, best, ball = likelihood - best, likelihood, following
        kernel.sphere_likelihood(observed, ball, spread, score, information)
        if gain < SLIGHT_GAIN:
            return ball
    return ball


def _observed(pixels: TargetPixels, sensor: DepthSensor, limb: Limb) -> kernel.Pixels:
    """The target's pixels, and where the outline counts those around it."""
    cols, rows, numbers = pixels.cols, pixels.rows, sensor.numbers_of(pixels.depths_m)
    if limb.blur_px > 0.0:
        reach = math.ceil(4.0 * limb.blur_px) + 2
        low = np.floor([cols.min(), rows.min()]).astype(int) - reach
        high = np.ceil([cols.max(), rows.max()]).astype(int) + reach
        known = np.zeros(high - low + 1, bool)
        known[np.rint(cols).astype(int) - low[0], np.rint(rows).astype(int) - low[1]] = True
        around = np.argwhere(~known) + low
        cols, rows = np.append(cols, around[:, 0]), np.append(rows, around[:, 1])
        numbers = np.append(numbers, np.full(len(around), np.nan))
    return kernel.Pixels(np.ascontiguousarray(sensor.rays(cols, rows)), np.ascontiguousarray(numbers))


def _spread(sensor: DepthSensor, limb: Limb, noise_steps: float) -> kernel.Spread:
    focal = sensor.focal_px
    blur, margin = limb.blur_px / focal, limb.margin_px / focal
    return kernel.Spread(sensor.offset_per_m, sensor.step_per_m, noise_steps, blur, margin)


def _check_no_plane(pixels: TargetPixels, sensor: DepthSensor) -> None:
    """Raise MeasurementError where a plane leaves of the numbers little more than rounding and noise do.

    A plane's inverse depth, and so its number, is linear in column and row.
    """
    table = np.column_stack([pixels.cols, pixels.rows, np.ones(len(pixels.cols))])
    values = sensor.numbers_of(pixels.depths_m)
    off = values - table @ np.linalg.lstsq(table, values, rcond=None)[0]
    steps = math.sqrt(float(off @ off) / (len(off) - 3))
    if steps < AS_PLANE * math.hypot(1.0 / math.sqrt(12.0), sensor.noise_steps):
        raise MeasurementError(
            f"The points lie on a plane to {steps:.2g} steps of the sensor, which rounding alone may leave; which ball "
            "it would be cannot be told."
        )


def _points(points_m: npt.ArrayLike) -> Array:
    points = positions("points_m", points_m)
    if len(points) < LEAST_POINTS:
        raise MeasurementError(f"A ball needs {LEAST_POINTS} points at least, not {len(points)}.")
    return points


def _algebraic(points: Array) -> Array:
    """(centre, radius), (4,)."""
    middle = points.mean(axis=0)
    about = points - middle
    table = np.column_stack([2.0 * about, np.ones(len(about))])
    found, _, rank, _ = np.linalg.lstsq(table, (about**2).sum(axis=1), rcond=1e-10)
    square = float(found[3] + found[:3] @ found[:3])
    if rank < 4 or not square > 0.0:
        raise MeasurementError("The points lie on a plane, not on a ball.")
    return np.append(found[:3] + middle, math.sqrt(square))


def _distances(points: Array, ball: Array) -> tuple[Array, Array]:
    """(derivatives (n, 4), distances of points from the ball, outwards)."""
    away = points - ball[:3]
    length = np.linalg.norm(away, axis=1)
    rows = np.column_stack([-away / length[:, None], -np.ones(len(points))])
    return rows, length - ball[3]


def _judged(points: Array, ball: Array) -> SphereFit:
    rows, off = _distances(points, ball)
    sigma = math.sqrt(float(off @ off) / (len(points) - 4))
    plane = fit_plane(points)
    if not np.isfinite(ball).all() or plane.sigma_m < AS_PLANE * sigma:
        raise MeasurementError(
            f"The points lie on a plane (to {1e3 * plane.sigma_m:.3g} mm) about as well as on a ball; which ball it "
            "would be cannot be told."
        )
    covariance = (sigma**2 * np.linalg.inv(rows.T @ rows)).astype(np.float64)
    return SphereFit(ball[:3].copy(), float(ball[3]), covariance, sigma, len(points))
