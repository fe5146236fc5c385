"""Whether a path can be driven by something that cannot turn on the spot."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from .reports import LimitCheck, PathLimit, check_of
from .walking import Walk

__all__ = ["turning_checks"]

Numbers = npt.NDArray[np.float64]

# Vertices on an arc of the radius itself are that far off by rounding, and where an arc begins between two of them.
RADIUS_SLACK = 0.02
# A bend of more than this at one vertex is a corner and no arc.
SHARPEST_BEND_RAD = math.radians(30.0)
HEADING_SLACK_RAD = 2e-3


def turning_checks(
    walk: Walk, *, min_turning_radius_m: float, can_reverse: bool, start_heading_rad: float | None
) -> list[LimitCheck]:
    """The circle through each three vertices in a row must not be smaller than the turning radius, nor the bend sharp.

    can_reverse: at a cusp, where the way turns back, it is the way on seen backwards that counts.
    start_heading_rad: clockwise from grid north; the first leg must be a chord of an arc that begins with it.
    """
    if min_turning_radius_m == 0.0 or len(walk.corners_m) < 2:
        return []
    at = np.flatnonzero(walk.vertex >= 0)
    legs = np.diff(walk.corners_m, axis=0)
    checks = []
    if len(legs) > 1:
        radius_m = _radii_m(legs[:-1], legs[1:], can_reverse)
        slack_m = RADIUS_SLACK * min_turning_radius_m
        checks.append(
            check_of(walk, PathLimit.TURNING, radius_m, min_turning_radius_m, at_least=True, slack=slack_m, at=at[1:-1])
        )
    if start_heading_rad is not None:
        ahead = np.array([[math.sin(start_heading_rad), math.cos(start_heading_rad)]])
        off = _bend(ahead, legs[:1])
        if can_reverse:
            off = np.minimum(off, math.pi - off)
        first_m = float(np.hypot(*legs[0]))
        allowed = math.asin(min(first_m / (2.0 * min_turning_radius_m), 1.0))
        checks.append(check_of(walk, PathLimit.START_HEADING, off, allowed, slack=HEADING_SLACK_RAD, at=at[:1]))
    return checks


def _radii_m(before: Numbers, after: Numbers, can_reverse: bool) -> Numbers:
    """(n,) radius of the circle through the ends of two legs (n, 2); 0 at a corner, inf straight on."""
    bend = _bend(before, after)
    if can_reverse:
        back = bend > math.pi / 2
        after = np.where(back[:, None], -after, after)
        bend = np.where(back, math.pi - bend, bend)
    across_m = np.hypot(*(before + after).T)
    sine = np.sin(bend)
    straight = sine < 1e-12
    radius_m = np.where(straight, np.inf, across_m / (2.0 * np.where(straight, 1.0, sine)))
    return np.where(bend > SHARPEST_BEND_RAD, 0.0, radius_m)


def _bend(before: Numbers, after: Numbers) -> Numbers:
    """(n,) angle between two directions, 0 to pi."""
    turned = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    bend: Numbers = np.arctan2(np.abs(turned), (before * after).sum(axis=1))
    return bend
