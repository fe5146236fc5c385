"""Ground under the rover as one range more of an epoch: to a point so far along the ground's normal that all is level.

A sphere so large is the plane in which the antenna moves. So the search for the ranges that meet knows the ground as it
knows a range: it checks the others, settles sides, and may itself be what does not fit.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from .epochs import GroundHeight
from .geometric import MOST_RANGES, GeometricDetection, detect_ranges
from .settings import DetectorSettings
from .subset_search import Ranges

__all__ = ["detect_standing"]

FAR_M = 50_000.0  # a hundred metres off, the sphere leaves its plane by a tenth of a metre
RIGHT_PENALTY = 2.0 * math.log(0.95 / 0.05)  # the ground is seldom what is wrong


def detect_standing(
    moment: Ranges,
    ground: GroundHeight | None,
    dimension: Literal[2, 3],
    hint_m: npt.NDArray[np.float64],
    settings: DetectorSettings,
) -> GeometricDetection:
    """``detect_ranges`` of an epoch of ranges, with the ground among them where it is told; it is not in the answer."""
    n = len(moment.ranges_m)
    told = ground is not None and n < MOST_RANGES
    ranges = _with_ground(moment, ground, settings.k_geometric) if told and ground is not None else moment
    found = detect_ranges(ranges, dimension, hint_m, refine=True, studentised=True, limit=settings.search_limit)
    if not told:
        return found
    fits = found.position_m is not None and not found.off[n]
    return replace(
        found,
        off=found.off[:n],
        unknown=found.unknown[:n],
        p_occluded=found.p_occluded[:n],
        excess_m=found.excess_m[:n],
        statistic=found.statistic[:n],
        count=found.count - int(fits),
        candidates=tuple(tuple(i for i in one if i < n) for one in found.candidates),
    )


def _with_ground(moment: Ranges, ground: GroundHeight, k: float) -> Ranges:
    normal = np.array([-ground.slope_east, -ground.slope_north, 1.0])
    steep = float(np.linalg.norm(normal))
    far_m = np.array([ground.east_m, ground.north_m, ground.altitude_m]) + FAR_M / steep * normal
    sigma_m = ground.sigma_m / steep  # upright as told; across the plane it is less
    return Ranges(
        np.vstack([moment.anchors_m, far_m]),
        np.append(moment.ranges_m, FAR_M),
        np.append(moment.sigmas_m, sigma_m),
        np.append(moment.tolerances_m, k * sigma_m),
        np.append(moment.penalties, RIGHT_PENALTY),
    )
