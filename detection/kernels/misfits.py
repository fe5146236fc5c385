"""How well ranges meet at a place: the excess of each, against what the fit took up and what the place is unsure of.

Ranges and sets as in ``fits``.
"""

import math

import numpy as np

from compiled.options import scalar_kernel

from .small_systems import Symmetric, from_anchor, inverse, quadratic_form

__all__ = ["EXCESS", "VARIANCE", "by_others", "meets", "statistics", "unwatched"]

NO_REDUNDANCY = 1e-6
# Share of an error in a range that has to be left over in the ranges' misfit, squared: what it is off by shows from 30
# tolerances on at the latest.
WATCHED = 1e-3

E, N, U = 0, 1, 2  # east, north, up
EXCESS, VARIANCE = 0, 1  # columns of what the other ranges tell of one, m and m²


@scalar_kernel
def _spread(ranges, kept, flat, place):
    """(covariance of a place that the kept ranges are fitted at, whether it exists)."""
    anchors, measured, sigmas, _, _ = ranges
    ee, en, eu, nn, nu, uu = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(measured.shape[0]):
        if (kept >> i) & 1:
            east, north, up, _ = from_anchor(place, anchors, i)
            weight = 1.0 / (sigmas[i] * sigmas[i] * max(east * east + north * north + up * up, 1e-18))
            ee, en, eu = ee + weight * east * east, en + weight * east * north, eu + weight * east * up
            nn, nu, uu = nn + weight * north * north, nu + weight * north * up, uu + weight * up * up
    if flat:
        uu = 0.5 * (ee + nn)
    ridge = 1e-9 * (ee + nn + uu)
    return inverse(Symmetric(ee + ridge, en, eu, nn + ridge, nu, uu + ridge))


@scalar_kernel
def unwatched(ranges, kept, flat, place):
    """The kept ranges that no others check: what they are off by, the place takes up (two anchors close together)."""
    anchors, measured, sigmas, _, _ = ranges
    covariance, exists = _spread(ranges, kept, flat, place)
    found = np.int64(0)
    for i in range(measured.shape[0]):
        if (kept >> i) & 1:
            east, north, up, distance = from_anchor(place, anchors, i)
            over = 1.0 / max(distance, 1e-9)
            variance = quadratic_form(covariance, east * over, north * over, up * over) / (sigmas[i] * sigmas[i])
            if not exists or 1.0 - variance < WATCHED:
                found |= np.int64(1) << i
    return found


@scalar_kernel
def statistics(ranges, kept, flat, place, studentised, excess, statistic):
    """Write of every range its excess over the distance, m, and |excess| in tolerances.

    Studentised tolerances shrink by what the fit absorbed (kept ranges), grow by what the place is unsure of (others).
    """
    anchors, measured, sigmas, tolerances, _ = ranges
    covariance, exists = _spread(ranges, kept if studentised else 0, flat, place)
    for i in range(measured.shape[0]):
        east, north, up, distance = from_anchor(place, anchors, i)
        excess[i] = measured[i] - distance
        statistic[i] = abs(excess[i]) / tolerances[i]
        if studentised and exists and distance > 0.0:
            over = 1.0 / distance
            variance = quadratic_form(covariance, east * over, north * over, up * over) / (sigmas[i] * sigmas[i])
            if (kept >> i) & 1:
                statistic[i] /= math.sqrt(max(1.0 - variance, NO_REDUNDANCY))
            else:
                statistic[i] /= math.sqrt(1.0 + variance)


@scalar_kernel
def meets(ranges, kept, flat, place, studentised, work):
    """Whether all kept ranges meet at a place; writes into work, two (n,) arrays, as ``statistics`` does."""
    excess, statistic = work
    statistics(ranges, kept, flat, place, studentised, excess, statistic)
    beyond = 0
    for i in range(statistic.shape[0]):
        if (kept >> i) & 1 and not statistic[i] <= 1.0:
            beyond += 1
    return beyond == 0


@scalar_kernel
def by_others(ranges, kept, flat, place, ahead, agrees, told):
    """Write into told (n, 2) the EXCESS of each range over where the other kept ones meet, and its VARIANCE.

    Nothing is written of a range that nothing checks, and of none where the place is further than so many sigmas from
    ahead: (place (3,), covariance (3, 3)) that a track leads to. told comes with infinite variances.
    """
    anchors, measured, sigmas, _, _ = ranges
    covariance, exists = _spread(ranges, kept, flat, place)
    ee, en, eu, nn, nu, uu = covariance
    ahead_place, ahead_covariance = ahead
    weights, sure = inverse(
        Symmetric(
            ee + ahead_covariance[E, E],
            en + ahead_covariance[E, N],
            eu + ahead_covariance[E, U],
            nn + ahead_covariance[N, N],
            nu + ahead_covariance[N, U],
            uu + ahead_covariance[U, U],
        )
    )
    off = quadratic_form(weights, place[E] - ahead_place[E], place[N] - ahead_place[N], place[U] - ahead_place[U])
    if not (exists and sure and off <= agrees * agrees):
        return
    for i in range(measured.shape[0]):
        east, north, up, distance = from_anchor(place, anchors, i)
        distance = max(distance, 1e-9)
        variance = quadratic_form(covariance, east / distance, north / distance, up / distance)
        # what the range itself added to the place is taken out again
        left = 1.0 - variance / (sigmas[i] * sigmas[i]) if (kept >> i) & 1 else 1.0
        if left >= WATCHED:
            told[i, EXCESS], told[i, VARIANCE] = (measured[i] - distance) / left, variance / left
