"""What a filter believes at an instant: mean and covariance of position, velocity and clock."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .errors import StateError
from .inputs import check_covariance, numbers

__all__ = ["FilterState", "initial_state"]

Array = npt.NDArray[np.float64]

WITHOUT_CLOCK, WITH_CLOCK = 6, 8
POSITION = slice(0, 5, 2)
VELOCITY = slice(1, 6, 2)


@dataclass(frozen=True, eq=False)
class FilterState:
    """A belief about a vehicle (De Vivo et al., eq. 29, with east, north, up in place of north, east, down).

    mean: (6,) east, east rate, north, north rate, up, up rate in m and m/s; with a receiver's clock (8,), followed by
        its offset in m and its drift in m/s. covariance: of the same, symmetric and not negative. Both are kept as
        read-only copies.
    doubt: each measurement that a gate kept out adds one, each that was used takes two away; at 12 the belief is taken
        for wrong and widened, and says so.
    Raises StateError.
    """

    time_s: float
    mean: Array
    covariance: Array
    doubt: float = 0.0

    def __post_init__(self) -> None:
        size = np.size(self.mean)
        if size not in (WITHOUT_CLOCK, WITH_CLOCK):
            raise StateError(f"mean must hold 6 numbers, or 8 with a clock, not {size}.")
        mean = numbers("mean", self.mean, (size,), StateError)
        covariance = numbers("covariance", self.covariance, (size, size), StateError)
        if not math.isfinite(self.time_s):
            raise StateError(f"time_s must be a finite number, not {self.time_s}.")
        if not np.isfinite(mean).all():
            raise StateError(f"mean must hold finite numbers, not {mean.tolist()}.")
        check_covariance("covariance", covariance)
        mean.setflags(write=False)
        covariance.setflags(write=False)
        object.__setattr__(self, "mean", mean)
        object.__setattr__(self, "covariance", covariance)

    @property
    def position_m(self) -> Array:
        """(3,) east, north, up."""
        return self.mean[POSITION]

    @property
    def velocity_m_per_s(self) -> Array:
        """(3,) east, north, up."""
        return self.mean[VELOCITY]

    @property
    def position_covariance_m2(self) -> Array:
        """(3, 3) east, north, up."""
        return self.covariance[POSITION, POSITION]


def initial_state(
    time_s: float,
    position_m: npt.ArrayLike,
    velocity_m_per_s: npt.ArrayLike = (0.0, 0.0, 0.0),
    *,
    position_sigma_m: npt.ArrayLike = 10.0,
    velocity_sigma_m_per_s: npt.ArrayLike = 1.0,
    clock_m: tuple[float, float] | None = None,
    clock_sigma_m: tuple[float, float] = (100.0, 1.0),
) -> FilterState:
    """A first belief with independent errors.

    position_sigma_m, velocity_sigma_m_per_s: one number, or (3,) east, north, up. clock_m: offset in m and drift in
    m/s of the receiver's clock, None = ranges need none. Raises StateError.
    """
    mean, sigma = np.zeros(WITHOUT_CLOCK), np.zeros(WITHOUT_CLOCK)
    mean[POSITION] = numbers("position_m", position_m, (3,), StateError)
    mean[VELOCITY] = numbers("velocity_m_per_s", velocity_m_per_s, (3,), StateError)
    sigma[POSITION] = _of_axes("position_sigma_m", position_sigma_m)
    sigma[VELOCITY] = _of_axes("velocity_sigma_m_per_s", velocity_sigma_m_per_s)
    if clock_m is not None:
        mean = np.concatenate([mean, numbers("clock_m", clock_m, (2,), StateError)])
        sigma = np.concatenate([sigma, numbers("clock_sigma_m", clock_sigma_m, (2,), StateError)])
    if not (sigma >= 0.0).all():
        raise StateError("sigmas must be zero or more.")
    return FilterState(time_s, mean, np.diag(sigma**2))


def _of_axes(name: str, sigma: npt.ArrayLike) -> Array:
    """(3,) from one number or three."""
    return numbers(name, np.broadcast_to(sigma, (3,)) if np.ndim(sigma) == 0 else sigma, (3,), StateError)
