"""From the uncertainties of the parts to the tolerances of the tests (seed 000, "Error Propagation")."""

from __future__ import annotations

import math
from statistics import NormalDist

from .errors import DetectionInputError

__all__ = ["false_positive_rate", "k_for_false_positive_rate", "sigma_geometric_m", "sigma_odometry_m"]


def sigma_geometric_m(
    range_sigma_m: float,
    anchor_sigma_m: float = 0.0,
    calculation_sigma_m: float = 0.0,
    speed_m_per_s: float = 0.0,
    time_sigma_s: float = 0.0,
) -> float:
    """One sigma of a range against the geometry: ranging, the anchor's place along the range, and the calculation.

    A rover that moves adds what its speed makes of times that are not known better (seed 000 has that for odometry).
    """
    moved_m = speed_m_per_s * time_sigma_s
    return math.sqrt(range_sigma_m**2 + anchor_sigma_m**2 + calculation_sigma_m**2 + moved_m**2)


def sigma_odometry_m(
    wheel_sigma_m: float, accelerometer_sigma_m: float = 0.0, speed_m_per_s: float = 0.0, time_sigma_s: float = 0.0
) -> float:
    """One sigma of a displacement: wheels, accelerometer, and the time that speed turns into metres."""
    return math.sqrt(wheel_sigma_m**2 + accelerometer_sigma_m**2 + (speed_m_per_s * time_sigma_s) ** 2)


def false_positive_rate(k: float) -> float:
    """Share of clear ranges beyond k sigma: 4.6 % at 2, 0.27 % at 3, 0.0063 % at 4; raises DetectionInputError."""
    if not (math.isfinite(k) and k > 0.0):
        raise DetectionInputError(f"k must be a number > 0, not {k}.")
    return math.erfc(k / math.sqrt(2.0))


def k_for_false_positive_rate(rate: float) -> float:
    """How many sigmas a tolerance takes for so large a share of clear ranges beyond it; raises DetectionInputError."""
    if not 0.0 < rate < 1.0:
        raise DetectionInputError(f"A false-positive rate lies between 0 and 1, not at {rate}.")
    return -NormalDist().inv_cdf(rate / 2.0)
