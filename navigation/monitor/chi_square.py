"""Limits of tests, for a rover that carries no SciPy: chi-square and normal quantiles from their closed forms."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError

__all__ = ["chi_square_limit", "chi_square_limits", "chi_square_tail"]

Array = npt.NDArray[np.float64]


def chi_square_tail(statistic: float, degrees: int) -> float:
    """Probability that a chi-square number of that many degrees is larger.

    Of an even number of degrees a Poisson sum, of an odd one the normal tail and a sum like it (Abramowitz and Stegun,
    26.4.4 and 26.4.5).
    """
    half = statistic / 2.0
    if half <= 0.0:
        return 1.0
    if math.isinf(half):
        return 0.0
    odd = degrees % 2
    total = math.erfc(math.sqrt(half)) if odd else 0.0
    logarithm = math.log(half)
    for i in range(degrees // 2):
        power = i + 0.5 * odd
        total += math.exp(power * logarithm - half - math.lgamma(power + 1.0))
    return min(total, 1.0)


def chi_square_limit(probability: float, degrees: int) -> float:
    """What a chi-square number passes with that probability. Raises MeasurementError."""
    if not 0.0 < probability < 1.0 or degrees < 1:
        raise MeasurementError(
            "The rate of false alarms must lie between 0 and 1, and there must be something to test."
        )
    low, high = 0.0, 2.0 * degrees + 10.0
    while chi_square_tail(high, degrees) > probability:
        high *= 2.0
    while high - low > 1e-12 * high:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if chi_square_tail(middle, degrees) > probability else (low, middle)
    return high


def chi_square_limits(probability: float, most_degrees: int) -> Array:
    """(most_degrees + 1,) limits by degrees of freedom; inf for none, which nothing passes. Raises MeasurementError."""
    return np.array([math.inf, *(chi_square_limit(probability, d) for d in range(1, most_degrees + 1))])
