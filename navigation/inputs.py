"""Numbers as callers give them, checked once before they go to the kernels."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from .errors import BubbleError, MeasurementError, NavigationError, StateError
from .kernels import covariance as kernel

__all__ = ["check_covariance", "check_positive", "numbers", "positions", "table"]

Array = npt.NDArray[np.float64]

FAULTS = {
    kernel.NOT_FINITE: "holds numbers that are not finite",
    kernel.NOT_SYMMETRIC: "is not symmetric",
    kernel.NOT_POSITIVE: "is not positive: some combination of its coordinates has a negative variance",
}


def numbers(
    name: str, values: npt.ArrayLike, shape: tuple[int, ...], error: type[NavigationError] = MeasurementError
) -> Array:
    """C-contiguous float64 copy of that shape; raises ``error`` that names what should have been numbers."""
    try:
        array = np.array(values, np.float64, order="C")
    except (TypeError, ValueError) as fault:
        raise error(f"{name} must hold numbers of shape {shape} ({fault}).") from fault
    if array.shape != shape:
        raise error(f"{name} must have shape {shape}, not {array.shape}.")
    return array


def positions(name: str, values_m: npt.ArrayLike, error: type[NavigationError] = MeasurementError) -> Array:
    """(n, 3) float64 copy of finite positions; raises ``error`` that names the offender."""
    try:
        array = np.array(values_m, np.float64, order="C")
    except (TypeError, ValueError) as fault:
        raise error(f"{name} must hold east, north and altitude in metres ({fault}).") from fault
    if array.size == 0:
        return np.empty((0, 3))
    if array.ndim != 2 or array.shape[1] != 3:
        raise error(f"{name} must hold one row of east, north and altitude for each, not shape {array.shape}.")
    broken = ~np.isfinite(array).all(axis=1)
    if broken.any():
        first = int(np.argmax(broken))
        raise error(f"{name}[{first}] must be three finite numbers, not {array[first].tolist()}.")
    return array


def table(name: str, values: npt.ArrayLike, points: int, anchors: int, error: type[NavigationError]) -> Array:
    """(points, anchors) float64 copy of values given for each point and anchor, for each anchor, or one for all."""
    try:
        array = np.array(values, np.float64)
        full = np.array(np.broadcast_to(array, (points, anchors)), order="C")
    except (TypeError, ValueError) as fault:
        raise error(
            f"{name} must be one number for each of the {anchors} anchors, or for each of the {points} points and "
            f"{anchors} anchors, not shape {np.shape(values)}."
        ) from fault
    return full


def check_covariance(name: str, covariance: Array) -> None:
    """Raises StateError, saying why, where a square matrix is no covariance."""
    fault = kernel.covariance_fault(covariance)
    if fault != kernel.OK:
        raise StateError(f"{name} {FAULTS[fault]}.")


def check_positive(name: str, value: float, *, zero: bool = False) -> float:
    """The number; raises BubbleError where it is not finite and above (or at) 0."""
    value = float(value)
    if not (math.isfinite(value) and (value > 0.0 or (zero and value == 0.0))):
        raise BubbleError(f"{name} must be {'zero or more' if zero else 'above zero'}, not {value:g}.")
    return value
