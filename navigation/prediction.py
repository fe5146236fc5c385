"""Bubbles along a path before it is driven: what the covariance will be, given who will be in sight where."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .bubbles import bubble_radius_m
from .errors import BubbleError, TimeOrderError
from .inputs import check_covariance, check_positive, numbers, positions
from .kernels.prediction import covariances_along
from .motion import MotionNoise
from .quality import range_variances_m2
from .states import initial_state

__all__ = ["PredictedBubble", "predict_bubble"]

Array = npt.NDArray[np.float64]

# epochs between the points of one path: 100 days at 1 Hz
MOST_EPOCHS = 10_000_000


@dataclass(frozen=True, eq=False)
class PredictedBubble:
    """The answer to ``predict_bubble``, for n points.

    radius_m: (n,). position_covariance_m2: (n, 3, 3) east, north, up, after the ranges at each point.
    """

    radius_m: Array
    position_covariance_m2: Array

    @property
    def trace_m2(self) -> Array:
        """(n,) trace of the position's covariance."""
        trace: Array = np.trace(self.position_covariance_m2, axis1=1, axis2=2)
        return trace


def predict_bubble(
    points_m: npt.ArrayLike,
    times_s: npt.ArrayLike,
    anchors_m: npt.ArrayLike,
    visible: npt.ArrayLike,
    range_sigma_m: npt.ArrayLike,
    *,
    motion: MotionNoise | None = None,
    interval_s: float | None = None,
    clock: bool = False,
    dop: npt.ArrayLike | None = None,
    weights: npt.ArrayLike | None = None,
    initial_covariance: npt.ArrayLike | None = None,
    ground_slope: npt.ArrayLike | None = None,
    ground_sigma_m: float = 0.5,
    epsilon: float = 3.0,
    dem_sigma_m: npt.ArrayLike = 0.0,
) -> PredictedBubble:
    """The filter's covariance and its bubble along a path, without a measurement: the linear part of eqs. 28-35.

    points_m: (n, 3) east, north, up; times_s: (n,), never backwards; anchors_m: (k, 3), satellites by their position.
    visible: (n, k), which anchor will be in sight at which point; what is not known counts as hidden.
    range_sigma_m: (k,) or (n, k) or one for all; its square is the µ of eq. 26 where ``dop`` (n,) is given, and the
        variance otherwise. weights: (k,) or (n, k), see ``range_variances_m2``.
    interval_s: time between ranges. They then come at whole multiples of it from the first point on, on the straight
        line between two points, from anchors in sight at both. None: once at each point.
    clock: whether the ranges are pseudoranges. initial_covariance: (6, 6), with a clock (8, 8), at the first point
        before its ranges; None: 10 m, 1 m/s, clock 100 m and 1 m/s.
    ground_slope: (n, 2) rise per metre east and north, for a rover on the ground: its height is known then from the
        DEM, with ground_sigma_m. epsilon, dem_sigma_m: see ``bubble_radius_m``.
    Raises BubbleError, MeasurementError, StateError, TimeOrderError.
    """
    points, anchors = positions("points_m", points_m, BubbleError), positions("anchors_m", anchors_m)
    n = len(points)
    times = numbers("times_s", times_s, (n,), BubbleError)
    _check_times(times)
    seen = np.asarray(visible, np.bool_)
    if seen.shape != (n, len(anchors)):
        raise BubbleError(
            f"visible must tell of each of {n} points and {len(anchors)} anchors whether they see each other, "
            f"not shape {seen.shape}."
        )
    sigma_m = np.asarray(range_sigma_m, np.float64)
    variances = range_variances_m2(sigma_m**2, seen, dop=dop, weights=weights)
    covariance = _initial(initial_covariance, clock)
    interval = 0.0 if interval_s is None else check_positive("interval_s", interval_s)
    if interval > 0.0 and n > 0 and (times[-1] - times[0]) / interval > MOST_EPOCHS:
        raise BubbleError(f"{times[-1] - times[0]:g} s hold more than {MOST_EPOCHS:,} intervals of {interval:g} s.")
    ground = np.empty((0, 3))
    if ground_slope is not None:
        slope = numbers("ground_slope", ground_slope, (n, 2), BubbleError)
        variance_m2 = check_positive("ground_sigma_m", ground_sigma_m) ** 2
        ground = np.column_stack([slope, np.full(n, variance_m2)])
        if not np.isfinite(slope).all():
            raise BubbleError("ground_slope must hold finite numbers.", index=_first(~np.isfinite(slope).all(axis=1)))
    out = np.zeros((n, 3, 3))
    psd = (motion or MotionNoise()).psd()
    if n > 0:
        covariances_along(points, times, anchors, variances, covariance, (psd, interval), ground, out)
    return PredictedBubble(bubble_radius_m(out, epsilon, dem_sigma_m=dem_sigma_m), out)


def _check_times(times_s: Array) -> None:
    if not np.isfinite(times_s).all():
        raise BubbleError("times_s must hold finite numbers.", index=_first(~np.isfinite(times_s)))
    back = np.diff(times_s) < 0.0
    if back.any():
        first = _first(back) + 1
        raise TimeOrderError(
            f"times_s must not go backwards: {times_s[first]:g} s follows {times_s[first - 1]:g} s at point {first}.",
            index=first,
        )


def _initial(covariance: npt.ArrayLike | None, clock: bool) -> Array:
    if covariance is None:
        return initial_state(0.0, (0.0, 0.0, 0.0), clock_m=(0.0, 0.0) if clock else None).covariance.copy()
    size = 8 if clock else 6
    given = numbers("initial_covariance", covariance, (size, size), BubbleError)
    check_covariance("initial_covariance", given)
    return given


def _first(flags: npt.ArrayLike) -> int:
    return int(np.argmax(flags))
