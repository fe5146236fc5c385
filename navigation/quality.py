"""How far each range is trusted: R = DOP·diag(µ) over the anchors predicted in sight (De Vivo et al., eq. 26)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .errors import MeasurementError
from .inputs import table

__all__ = ["range_variances_m2"]

Array = npt.NDArray[np.float64]


def range_variances_m2(
    mu_m2: npt.ArrayLike,
    visible: npt.ArrayLike,
    *,
    dop: npt.ArrayLike | None = None,
    weights: npt.ArrayLike | None = None,
) -> Array:
    """Variances of ranges to k anchors at an instant (k,), or at n points (n, k): the diagonal of R, inf = left out.

    mu_m2: (k,) or (n, k) the coefficient µ of each anchor in m²; with dop = None it is the variance itself.
    visible: (k,) or (n, k), whether the anchor is predicted in sight; what is hidden or not known is left out.
    dop: dilution of the anchors in sight, one number or (n,), as eq. 26 multiplies with; inf leaves all out.
    weights: what a detector at run time makes of each range, 0 (not to be believed) to 1: the variance is divided by
        it. (k,) or (n, k).
    Raises MeasurementError, also where an anchor has no µ (NaN) that is predicted in sight.
    """
    seen = np.asarray(visible)
    if seen.ndim not in (1, 2):
        raise MeasurementError(f"visible must be (anchors,) or (points, anchors), not shape {seen.shape}.")
    sight = np.atleast_2d(seen.astype(np.bool_))
    points, anchors = sight.shape
    variances = table("mu_m2", mu_m2, points, anchors, MeasurementError)
    missing = sight & ~(np.isfinite(variances) & (variances > 0.0))
    if missing.any():
        anchor = int(np.argmax(missing.any(axis=0)))
        value = variances[int(np.argmax(missing[:, anchor])), anchor]
        raise MeasurementError(
            f"Anchor number {anchor} is predicted in sight and needs a mu_m2 above zero, not {value}."
        )
    if dop is not None:
        dilution = np.asarray(dop, np.float64)
        if dilution.shape not in ((), (points,)) or not (dilution > 0.0).all():
            raise MeasurementError(f"dop must be above zero, one for all or one for each of the {points} points.")
        variances *= dilution.reshape(-1, 1)
    if weights is not None:
        share = table("weights", weights, points, anchors, MeasurementError)
        if not ((share >= 0.0) & (share <= 1.0)).all():
            raise MeasurementError("weights must lie between 0 and 1.")
        with np.errstate(divide="ignore", invalid="ignore"):
            variances = np.where(share > 0.0, variances / share, np.inf)
    variances[~sight] = np.inf
    return variances[0] if seen.ndim == 1 else variances
