"""Temporal differences of carrier phase: range changes without ambiguities (seed 002, eqs. 2.1, 2.2, 2.13, 2.14)."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError
from ..inputs import check_covariance, numbers

__all__ = ["difference_covariance", "phase_differences", "phase_rows", "prediction_check"]

Array = npt.NDArray[np.float64]


def phase_differences(
    phases_m: npt.ArrayLike,
    satellites_m: npt.ArrayLike,
    receivers_m: npt.ArrayLike,
) -> tuple[Array, Array]:
    """(changes (t-1, m), unit vectors to the satellites (t-1, m, 3)) of t epochs of carrier phase (eq. 2.1).

    phases_m: (t, m) phase times wavelength, with the satellites' own clocks added back, NaN = none; satellites_m:
    (t, m, 3) where each satellite sent it, turned with the Earth during the flight of the signal; receivers_m: (t, 3)
    where the receiver is believed (the previous place enters), or (3,). All in one frame, metres.
    What is left is the receiver's motion and clock: -(e, ΔR) + Δδt (eq. 2.2); eqs. 2.3 and 2.5 of the seed print +e,
    which is wrong by its own definition of e, as a numerical derivative tells. Raises MeasurementError.
    """
    phases = np.array(phases_m, np.float64)
    if phases.ndim != 2 or len(phases) < 2:
        raise MeasurementError(
            f"phases_m must be (epochs, satellites) of two epochs or more, not shape {phases.shape}."
        )
    satellites = numbers("satellites_m", satellites_m, (*phases.shape, 3))
    receivers = numbers("receivers_m", np.broadcast_to(receivers_m, (len(phases), 3)), (len(phases), 3))
    # each epoch's line of sight is from the place believed before it, for that is what is known when it comes in
    before = np.concatenate([receivers[:1], receivers[:-1]])
    away = satellites - before[:, None]
    units = away / np.linalg.norm(away, axis=2, keepdims=True)
    along = (units * satellites).sum(axis=2)
    moved = (units[1:] - units[:-1]) @ receivers[:-1, :, None]
    changes: Array = np.diff(phases, axis=0) - np.diff(along, axis=0) + moved[..., 0]
    return changes, units[1:]


def phase_rows(units: npt.ArrayLike) -> Array:
    """(..., m, 4) rows of a phase change: -e for the receiver's move, 1 for its clock in metres (eq. 2.6)."""
    e = np.asarray(units, np.float64)
    if e.shape[-1] != 3:
        raise MeasurementError(f"units must be (..., 3), not shape {e.shape}.")
    return np.concatenate([-e, np.ones((*e.shape[:-1], 1))], axis=-1)


def difference_covariance(sigma_m: float, epochs: int) -> Array:
    """(epochs, epochs) covariance of consecutive differences of one phase of that sigma: 2σ², and -σ² to neighbours.

    Two neighbours share a phase, so that they correlate by -0.5. Raises MeasurementError.
    """
    if not 0.0 < sigma_m < math.inf or epochs < 1:
        raise MeasurementError("sigma_m must be above zero and epochs at least 1.")
    return float(sigma_m) ** 2 * (2.0 * np.eye(epochs) - np.eye(epochs, k=1) - np.eye(epochs, k=-1))


def prediction_check(
    innovations: npt.ArrayLike,
    rows: npt.ArrayLike,
    covariance: npt.ArrayLike,
    sigmas: npt.ArrayLike,
    *,
    differences: bool,
    limit_sigma: float = 3.0,
) -> npt.NDArray[np.bool_]:
    """(m,) whether each measurement lies as far from what a filter foretells as may be (eqs. 2.13, 2.14).

    innovations: (m,) measured less foretold, the clock included, NaN = none: never good. rows: (m, n); covariance:
    (n, n) of the filter. sigmas: (m,) of one measurement. differences: these are differences in time of measurements of
    that sigma, whose variance is twice (eq. 2.14); False = the sigma is that of the innovation's own measurement.
    Raises MeasurementError, StateError.
    """
    innovation = np.atleast_1d(np.array(innovations, np.float64))
    p = np.array(covariance, np.float64)
    if p.ndim != 2 or p.shape[0] != p.shape[1]:
        raise MeasurementError(f"covariance must be square, not shape {p.shape}.")
    check_covariance("covariance", p)
    h = numbers("rows", rows, (innovation.size, len(p)))
    sigma = numbers("sigmas", np.broadcast_to(sigmas, innovation.shape), innovation.shape)
    if not (sigma > 0.0).all() or not limit_sigma > 0.0:
        raise MeasurementError("sigmas and limit_sigma must be above zero.")
    variance = np.einsum("mi,ij,mj->m", h, p, h) + (2.0 if differences else 1.0) * sigma**2
    good: npt.NDArray[np.bool_] = np.abs(innovation) < limit_sigma * np.sqrt(variance)
    return good
