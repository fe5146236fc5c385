"""The linear Kalman filter of Table III (De Vivo et al.): any linear model, and position fixes at constant velocity."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .errors import MeasurementError, StateError
from .inputs import check_covariance, numbers
from .kernels.ranges import LOST, reopen
from .states import POSITION, FilterState

__all__ = ["FixUpdate", "LinearUpdate", "linear_predict", "linear_update", "update_fix", "update_ground"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LinearUpdate:
    """Mean (n,) and covariance (n, n) after a measurement, its innovation (m,) and that one's covariance (m, m)."""

    mean: Array
    covariance: Array
    innovation: Array
    innovation_covariance: Array

    @property
    def nis(self) -> float:
        """Normalised innovation squared: chi-square with m degrees of freedom where model and noise are as stated."""
        return float(self.innovation @ np.linalg.solve(self.innovation_covariance, self.innovation))


@dataclass(frozen=True, eq=False)
class FixUpdate:
    """The state after a fix; innovation (m,), its covariance (m, m), and whether the gate let it in.

    reacquired: so many measurements were gated that the belief was lost; it was widened, and the fix used.
    """

    state: FilterState
    innovation: Array
    innovation_covariance: Array
    nis: float
    used: bool
    reacquired: bool = False


def linear_predict(
    mean: npt.ArrayLike,
    covariance: npt.ArrayLike,
    transition: npt.ArrayLike,
    process_noise: npt.ArrayLike,
    control: npt.ArrayLike | None = None,
) -> tuple[Array, Array]:
    """(mean, covariance) a step later: F·x + u and F·P·Fᵀ + Q (Table III); raises StateError."""
    x, p = _belief(mean, covariance)
    n = len(x)
    f = numbers("transition", transition, (n, n), StateError)
    q = numbers("process_noise", process_noise, (n, n), StateError)
    check_covariance("process_noise", q)
    u = np.zeros(n) if control is None else numbers("control", control, (n,), StateError)
    later = f @ p @ f.T + q
    return f @ x + u, (later + later.T) / 2.0


def linear_update(
    mean: npt.ArrayLike,
    covariance: npt.ArrayLike,
    measured: npt.ArrayLike,
    matrix: npt.ArrayLike,
    noise: npt.ArrayLike,
) -> LinearUpdate:
    """The belief after measured = H·x + noise of covariance R (Table III), corrected in Joseph form.

    measured: (m,); matrix: H (m, n); noise: R (m, m). Raises StateError, MeasurementError.
    """
    x, p = _belief(mean, covariance)
    z = np.atleast_1d(np.array(measured, np.float64))
    h = numbers("matrix", matrix, (len(z), len(x)), MeasurementError)
    r = numbers("noise", noise, (len(z), len(z)), MeasurementError)
    check_covariance("noise", r)
    if not np.isfinite(z).all():
        raise MeasurementError(f"measured must hold finite numbers, not {z.tolist()}.")
    innovation = z - h @ x
    p_zz = h @ p @ h.T + r
    try:
        gain = np.linalg.solve(p_zz, h @ p).T
    except np.linalg.LinAlgError as error:
        raise MeasurementError("noise must not be zero where the state is known for certain.") from error
    rest = np.eye(len(x)) - gain @ h
    corrected = rest @ p @ rest.T + gain @ r @ gain.T
    return LinearUpdate(x + gain @ innovation, (corrected + corrected.T) / 2.0, innovation, p_zz)


def update_fix(
    state: FilterState, position_m: npt.ArrayLike, covariance_m2: npt.ArrayLike, *, gate_sigma: float = math.inf
) -> FixUpdate:
    """The belief after a position fix (3,) with its covariance (3, 3), of a satellite receiver for example.

    gate_sigma: a fix whose innovation is further out, as a Mahalanobis distance, changes nothing.
    Raises MeasurementError, StateError.
    """
    rows = np.zeros((3, state.mean.size))
    rows[np.arange(3), [0, 2, 4]] = 1.0
    return _gated(state, numbers("position_m", position_m, (3,)), rows, covariance_m2, gate_sigma)


def update_ground(
    state: FilterState,
    height_m: float,
    slope: npt.ArrayLike = (0.0, 0.0),
    *,
    sigma_m: float = 0.5,
    gate_sigma: float = math.inf,
) -> FixUpdate:
    """The belief of a vehicle that knows it is on the ground.

    height_m: where its reference point stands by the map, at the position believed now: the DEM's height there plus the
    antenna's height above it. slope: rise of the ground per metre east and north there, so that a wrong position on a
    slope does not become a wrong height. sigma_m: of the map's height. Raises MeasurementError, StateError.
    """
    rise_east, rise_north = numbers("slope", slope, (2,))
    rows = np.zeros((1, state.mean.size))
    rows[0, [0, 2, 4]] = -rise_east, -rise_north, 1.0
    if not sigma_m > 0.0:
        raise MeasurementError(f"sigma_m must be above zero, not {sigma_m}.")
    east_m, north_m, _ = state.mean[POSITION]
    plane_m = float(height_m) - rise_east * east_m - rise_north * north_m
    return _gated(state, np.array([plane_m]), rows, [[float(sigma_m) ** 2]], gate_sigma)


def _gated(state: FilterState, measured: Array, rows: Array, noise: npt.ArrayLike, gate_sigma: float) -> FixUpdate:
    if not gate_sigma > 0.0:
        raise MeasurementError(f"gate_sigma must be above zero, not {gate_sigma}.")
    found = linear_update(state.mean, state.covariance, measured, rows, noise)
    used, reacquired = found.nis <= gate_sigma**2, False
    # the ground is as well where the rover is not: that it fits is no sign of a belief that is right
    relief = 2.0 * len(measured) if len(measured) > 1 else 0.0
    doubt = max(state.doubt - relief, min(state.doubt, 0.0)) if used else state.doubt + len(measured)
    if doubt >= LOST:
        wide = np.array(state.covariance)
        reopen(wide, float(found.innovation @ found.innovation))
        found = linear_update(state.mean, wide, measured, rows, noise)
        used, reacquired, doubt = True, True, 0.0
    after = replace(state, doubt=doubt)
    if used:
        after = FilterState(state.time_s, found.mean, found.covariance, doubt)
    return FixUpdate(after, found.innovation, found.innovation_covariance, found.nis, used, reacquired)


def _belief(mean: npt.ArrayLike, covariance: npt.ArrayLike) -> tuple[Array, Array]:
    size = np.size(mean)
    x = numbers("mean", mean, (size,), StateError)
    p = numbers("covariance", covariance, (size, size), StateError)
    check_covariance("covariance", p)
    return x, p
