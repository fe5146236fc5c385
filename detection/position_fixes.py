"""What a consistent set of ranges gives as a position: its side, its covariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from .subset_search import ConsistentSet, Ranges

__all__ = ["covariance_of", "settled_side"]

Floats = npt.NDArray[np.float64]

# Two places closer together than this are one: the rover is in the plane of its anchors.
ONE_PLACE_M = 1e-3
# Where ranges say nothing along an axis the covariance is this much larger than along the best known one.
UNKNOWN_ALONG = 1e-12


def settled_side(one: ConsistentSet, hint_m: Floats, dimension: int) -> tuple[ConsistentSet, Floats | None]:
    """The set at the place that a hint points to, and the mirrored place where no hint decides."""
    if one.mirror_m is None:
        return one, None
    here, there = np.array(one.place_m[:dimension]), np.array(one.mirror_m[:dimension])
    if np.linalg.norm(here - there) < ONE_PLACE_M:
        return one, None
    known = np.isfinite(hint_m)
    off_here, off_there = np.linalg.norm((here - hint_m)[known]), np.linalg.norm((there - hint_m)[known])
    if off_here == off_there:
        return one, there
    if off_there < off_here:
        one = replace(one, place_m=one.mirror_m, mirror_m=one.place_m, cost=one.mirror_cost, mirror_cost=one.cost)
    return one, None


def covariance_of(ranges: Ranges, one: ConsistentSet, dimension: int) -> Floats:
    """(d, d) covariance of the least squares at the place, m²; huge along an axis that the ranges say nothing of."""
    kept = np.array([one.kept >> i & 1 for i in range(len(ranges.ranges_m))], np.bool_)
    offset = (np.array(one.place_m) - ranges.anchors_m[kept])[:, :dimension]
    distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-9)
    rows = offset / (distance * ranges.sigmas_m[kept])[:, None]
    normal = rows.T @ rows
    normal += np.eye(dimension) * (UNKNOWN_ALONG * np.trace(normal))
    covariance: Floats = np.linalg.inv(normal)
    return covariance
