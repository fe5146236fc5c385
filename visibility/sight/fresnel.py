"""Radio formulas over a path: the first Fresnel zone and the loss over a knife edge."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["fresnel_radius_m", "knife_edge_loss_db"]

FREE_ABOVE = 0.6  # share of the first zone that must be clear for free-space propagation (ITU-R P.526)


def fresnel_radius_m(
    wavelength_m: npt.ArrayLike, near_m: npt.ArrayLike, far_m: npt.ArrayLike
) -> npt.NDArray[np.float64]:
    """Radius of the first Fresnel zone, metres: sqrt(wavelength·d1·d2 / (d1 + d2)), d1 and d2 from its ends."""
    wavelength, near, far = (np.asarray(value, np.float64) for value in (wavelength_m, near_m, far_m))
    radius_m: npt.NDArray[np.float64] = np.sqrt(wavelength * near * far / (near + far))
    return radius_m


def knife_edge_loss_db(fresnel_clearance: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Diffraction loss over one knife edge, dB, from its clearance in first-zone radii (negative = in the way).

    ITU-R P.526: J(v) = 6.9 + 20 lg(sqrt((v - 0.1)² + 1) + v - 0.1) with v = -sqrt(2)·clearance, 0 dB for v <= -0.78.
    Terrain that is not one sharp edge loses more. NaN stays NaN; -inf (an end below the ground) loses everything: +inf.
    """
    v = -np.sqrt(2.0) * np.asarray(fresnel_clearance, np.float64)
    above = np.maximum(v, -0.78) - 0.1
    loss_db: npt.NDArray[np.float64] = 6.9 + 20.0 * np.log10(np.hypot(above, 1.0) + above)
    return np.where(v <= -0.78, 0.0, loss_db)
