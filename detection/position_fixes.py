"""What a consistent set of ranges gives as a position: its places, its covariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from .subset_search import ConsistentSet, Ranges

__all__ = ["covariance_of", "settled_side"]

Floats = npt.NDArray[np.float64]

# Where ranges say nothing along an axis the covariance is this much larger than along the best known one.
UNKNOWN_ALONG = 1e-12
AXES = {2: np.eye(2), 3: np.eye(3)}


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
    normal += AXES[len(place_m)] * (UNKNOWN_ALONG * normal.trace())
    covariance: Floats = np.linalg.inv(normal)
    return covariance
