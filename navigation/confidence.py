"""What a bubble promises: the probability that it holds the vehicle, and the radius for a wanted probability."""

from __future__ import annotations

import functools

import numpy as np
import numpy.typing as npt

from .errors import BubbleError
from .kernels.spheres import probabilities_within, radii_of_probability

__all__ = ["bubble_confidence", "radius_of_confidence"]

Array = npt.NDArray[np.float64]

# Gauss-Legendre nodes per axis: 1e-8 of the probability, also for the flattest ellipsoids
NODES = 24


def bubble_confidence(position_covariance_m2: npt.ArrayLike, radius_m: npt.ArrayLike) -> Array:
    """Probability that a normally distributed error of covariance (..., 3, 3) is no longer than radius_m (...).

    One epsilon stands for different promises: r = 1·sqrt(trace P) holds 68.3 % of errors along one line, 63.2 % in a
    plane and 60.8 % of those equal in all directions; r = 2·sqrt(trace P) 95.4, 98.2 and 99.3 %. This is the promise of
    one bubble, exactly. NaN stays NaN. Raises BubbleError.
    """
    sigmas, shape = _principal_sigmas(position_covariance_m2)
    radii = np.ascontiguousarray(np.broadcast_to(np.asarray(radius_m, np.float64), shape)).reshape(-1)
    out = np.empty(len(sigmas))
    probabilities_within(radii, sigmas, _lattice(), out)
    return out.reshape(shape)


def radius_of_confidence(position_covariance_m2: npt.ArrayLike, confidence: float) -> Array:
    """Radius of the smallest sphere around the estimate that holds the vehicle with that probability.

    position_covariance_m2: (..., 3, 3); the result has the leading shape. confidence: above 0, below 1.
    Raises BubbleError.
    """
    if not 0.0 < confidence < 1.0:
        raise BubbleError(f"confidence must lie between 0 and 1, not be {confidence}.")
    sigmas, shape = _principal_sigmas(position_covariance_m2)
    out = np.empty(len(sigmas))
    radii_of_probability(float(confidence), sigmas, _lattice(), out)
    return out.reshape(shape)


def _principal_sigmas(position_covariance_m2: npt.ArrayLike) -> tuple[Array, tuple[int, ...]]:
    """(n, 3) sigmas along the principal axes, largest first, and the leading shape; raises BubbleError."""
    covariance = np.asarray(position_covariance_m2, np.float64)
    if covariance.shape[-2:] != (3, 3):
        raise BubbleError(f"position_covariance_m2 must be (..., 3, 3), not shape {covariance.shape}.")
    flat = covariance.reshape(-1, 3, 3)
    known = np.isfinite(flat).all(axis=(1, 2))
    variances = np.full((len(flat), 3), np.nan)
    variances[known] = np.linalg.eigvalsh(flat[known])[:, ::-1]
    if (variances < -1e-9 * np.abs(variances[:, :1])).any():
        raise BubbleError("position_covariance_m2 is not positive: some direction has a negative variance.")
    return np.sqrt(np.maximum(variances, 0.0)), covariance.shape[:-2]


@functools.cache
def _lattice() -> tuple[Array, Array]:
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    return (nodes + 1.0) / 2.0, weights / 2.0
