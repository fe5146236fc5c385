"""Covariances along a path before it is driven: the filter without its measurements."""

import math

import numpy as np

from compiled.options import scalar_kernel

from .covariance import grow, joseph
from .ranges import EAST, NORTH, UP, range_row

__all__ = ["covariances_along"]

# columns of the ground under the points of a path
SLOPE_EAST, SLOPE_NORTH, HEIGHT_VARIANCE = 0, 1, 2


@scalar_kernel
def _correct(covariance, place, anchors_m, variances_m2, work):
    """Correct covariance in place for ranges to every anchor of finite variance, as seen from place (n,)."""
    row, gain = work
    for a in range(anchors_m.shape[0]):
        if variances_m2[a] < math.inf:
            range_row(place, anchors_m[a], row)
            joseph(covariance, row, variances_m2[a], gain)


@scalar_kernel
def _bind(covariance, ground, work):
    """Correct covariance in place for ground under the rover: slope east, slope north, variance of its height."""
    row, gain = work
    row[:] = 0.0
    row[EAST], row[NORTH], row[UP] = -ground[SLOPE_EAST], -ground[SLOPE_NORTH], 1.0
    joseph(covariance, row, ground[HEIGHT_VARIANCE], gain)


@scalar_kernel
def covariances_along(points_m, times_s, anchors_m, variances_m2, covariance, motion, ground, out_m2):
    """Fill out_m2 (n, 3, 3) with the position's covariance after the ranges at each point of a path.

    points_m: (n, 3); times_s: (n,), never backwards; anchors_m: (k, 3). variances_m2: (n, k), inf = not in sight.
    covariance: (6, 6), with a clock (8, 8), at the first point before its ranges; it is used up. motion: psd (4,) and
    the seconds between ranges, 0 = once at each point. Between points the epochs fall on whole multiples of that from
    the first point on, on the straight line, with the greater variance of both ends. ground: (n, 3) slope east, slope
    north, variance of the height, or (0, 3) = not bound to the ground.
    """
    psd, interval_s = motion
    size = covariance.shape[0]
    place, between = np.zeros(size), np.empty(anchors_m.shape[0])
    work = (np.empty(size), np.empty(size))
    begin_s = times_s[0]
    now_s, epoch = begin_s, 0
    for p in range(points_m.shape[0]):
        if interval_s > 0.0:
            while begin_s + epoch * interval_s <= times_s[p]:
                epoch_s = begin_s + epoch * interval_s
                q = max(p - 1, 0)
                whole_s = times_s[p] - times_s[q]
                share = (epoch_s - times_s[q]) / whole_s if whole_s > 0.0 else 1.0
                for i in range(3):
                    place[2 * i] = points_m[q, i] + share * (points_m[p, i] - points_m[q, i])
                for a in range(between.shape[0]):
                    between[a] = max(variances_m2[q, a], variances_m2[p, a])
                grow(covariance, epoch_s - now_s, psd)
                _correct(covariance, place, anchors_m, between, work)
                if ground.shape[0] > 0:
                    _bind(covariance, ground[p], work)
                now_s = epoch_s
                epoch += 1
            grow(covariance, times_s[p] - now_s, psd)
        else:
            for i in range(3):
                place[2 * i] = points_m[p, i]
            grow(covariance, times_s[p] - now_s, psd)
            _correct(covariance, place, anchors_m, variances_m2[p], work)
            if ground.shape[0] > 0:
                _bind(covariance, ground[p], work)
        now_s = times_s[p]
        for i in range(3):
            for j in range(3):
                out_m2[p, i, j] = covariance[2 * i, 2 * j]
