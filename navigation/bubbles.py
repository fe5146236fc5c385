"""The safety bubble: a sphere around the estimate that the vehicle is in, kept clear of the ground."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .errors import BubbleError
from .inputs import check_positive

__all__ = ["bubble_radius_m"]

Array = npt.NDArray[np.float64]


def bubble_radius_m(
    position_covariance_m2: npt.ArrayLike, epsilon: float = 3.0, *, dem_sigma_m: npt.ArrayLike = 0.0
) -> Array:
    """r = epsilon·sqrt(trace P) plus the DEM's uncertainty (De Vivo et al., eq. 27 and III); NaN stays NaN.

    position_covariance_m2: (..., 3, 3); the result has the leading shape. epsilon: how many sigmas, above 0.
    dem_sigma_m: uncertainty of the ground's height: added to the bubble, so that the ground itself counts as exact.
    Raises BubbleError.
    """
    covariance = np.asarray(position_covariance_m2, np.float64)
    if covariance.shape[-2:] != (3, 3):
        raise BubbleError(f"position_covariance_m2 must be (..., 3, 3), not shape {covariance.shape}.")
    epsilon = check_positive("epsilon", epsilon)
    dem = np.asarray(dem_sigma_m, np.float64)
    if not (np.isfinite(dem) & (dem >= 0.0)).all():
        raise BubbleError("dem_sigma_m must be zero or more metres.")
    trace = np.trace(covariance, axis1=-2, axis2=-1)
    if (trace < 0.0).any():
        raise BubbleError("position_covariance_m2 has a negative trace.")
    radius: Array = epsilon * np.sqrt(trace) + dem
    return radius
