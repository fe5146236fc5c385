"""What a consistent set of ranges gives as a position: its places, its covariance."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from .subset_search import ConsistentSet, Ranges

__all__ = ["covariance_of", "settled_side", "squared_sigmas"]

Floats = npt.NDArray[np.float64]

# Where ranges say nothing along an axis the covariance is this much larger than along the best known one.
UNKNOWN_ALONG = 1e-12
# Variances further apart than this are nothing but a filter's rounding.
LEAST_SHARE = 1e-12


def settled_side(one: ConsistentSet, dimension: int) -> tuple[ConsistentSet, Floats | None]:
    """The set at its place, and the mirrored place where both are left; in 3D the lower comes first: drones fly."""
    place_m, mirror_m = one.place_m, one.mirror_m
    if mirror_m is None:
        return one, None
    if dimension == 3 and mirror_m[2] < place_m[2]:
        place_m, mirror_m = mirror_m, place_m
        one = replace(one, place_m=place_m, mirror_m=mirror_m, cost=one.mirror_cost, mirror_cost=one.cost)
    return one, np.array(mirror_m[:dimension])


def covariance_of(ranges: Ranges, kept: npt.NDArray[np.bool_], place_m: Floats) -> Floats:
    """(d, d) covariance of the least squares at a place (d,), m²; huge along an axis that the ranges say nothing of."""
    offset = place_m - ranges.anchors_m[kept, : len(place_m)]
    distance = np.maximum(np.sqrt((offset * offset).sum(axis=1)), 1e-9)
    rows = offset / (distance * ranges.sigmas_m[kept])[:, None]
    normal = rows.T @ rows
    if not math.isfinite(normal.trace()):
        return np.full_like(normal, np.nan)
    # by axes, so that no rounding makes a variance negative
    weights, axes = np.linalg.eigh(normal)
    covariance: Floats = axes / np.maximum(weights, UNKNOWN_ALONG * weights.sum()) @ axes.T
    return covariance


def squared_sigmas(off_m: Floats, covariance_m2: Floats) -> float:
    """How far off in squared sigmas; 0 where the covariance is none, so that nothing can be said to be far."""
    if not (math.isfinite(covariance_m2.sum()) and covariance_m2.trace() > 0.0):
        return 0.0
    variances_m2, axes = np.linalg.eigh(0.5 * (covariance_m2 + covariance_m2.T))
    along_m = off_m @ axes
    return float((along_m * along_m / np.maximum(variances_m2, LEAST_SHARE * variances_m2[-1])).sum())
