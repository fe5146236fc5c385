"""Whether a filter's covariance is the truth: NEES and NIS against two-sided chi-square bounds."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .errors import MeasurementError, StateError

__all__ = ["mean_bounds", "nees"]

Array = npt.NDArray[np.float64]


def nees(errors: npt.ArrayLike, covariances: npt.ArrayLike) -> Array:
    """Normalised estimation error squared, (...), of errors (..., n) with their covariances (..., n, n).

    Of a consistent filter it is chi-square with n degrees of freedom. Raises StateError.
    """
    error, covariance = np.asarray(errors, np.float64), np.asarray(covariances, np.float64)
    if covariance.shape != (*error.shape, error.shape[-1]):
        raise StateError(f"errors of shape {error.shape} need covariances of shape {(*error.shape, error.shape[-1])}.")
    solved = np.linalg.solve(covariance, error[..., None])[..., 0]
    squared: Array = (error * solved).sum(axis=-1)
    return squared


def mean_bounds(degrees: int, runs: int, probability: float = 0.95) -> tuple[float, float]:
    """(low, high) between which the mean of ``runs`` independent chi-square numbers lies with that probability.

    Two-sided: a filter that promises too little falls out below as one that promises too much does above.
    """
    if degrees < 1 or runs < 1 or not 0.0 < probability < 1.0:
        raise MeasurementError("degrees and runs must be at least 1, the probability between 0 and 1.")
    from scipy.special import gammaincinv  # for who judges filters; a rover that runs one need not carry SciPy

    tail = (1.0 - probability) / 2.0
    # the chi-square quantile; scipy.stats has it by name, and takes most of a second to import
    low, high = 2.0 * gammaincinv(0.5 * degrees * runs, [tail, 1.0 - tail]) / runs
    return float(low), float(high)
