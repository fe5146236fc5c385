"""Dilution of precision: normal matrices over the visible anchors of a point, and their inverses (eqs. 16-18).

Vectors are (east, north, up or altitude). A visible set is words (w,) uint64, bit a % 64 of word a // 64 for anchor a.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel

__all__ = [
    "CLOCK",
    "EE",
    "EN",
    "EU",
    "FREE",
    "GDOP",
    "HDOP",
    "NN",
    "NU",
    "OK",
    "PDOP",
    "PSEUDORANGE",
    "RANGING",
    "SINGULAR",
    "SINGULAR_BEYOND",
    "TDOA",
    "TDOP",
    "TOO_FEW",
    "UNKNOWN",
    "UU",
    "VDOP",
    "Dilutions",
    "Sources",
    "Symmetric",
    "covariance_of_set",
    "covariances_at_points",
    "dop_at_points",
    "dop_of_set",
]

# Kinds of range: clock known, clock solved for, clock differenced away.
RANGING, PSEUDORANGE, TDOA = 0, 1, 2

# Why a dilution is what it is.
OK, TOO_FEW, SINGULAR, UNKNOWN = 0, 1, 2, 3

# Sum of weights times trace of the position's covariance, n·PDOP² without weights: turning the world does not change
# it, and the rounding of the normal matrix (1e-16) is still 1e-4 of its least eigenvalue there.
SINGULAR_BEYOND = 1e12

# columns of dilutions; of covariances: the position's, then the clock's; of variances: after the ranging's, the pose's
GDOP, PDOP, HDOP, VDOP, TDOP = 0, 1, 2, 3, 4
EE, EN, EU, NN, NU, UU, CLOCK = 0, 1, 2, 3, 4, 5, 6
RANGE, POSE_EE, POSE_EN, POSE_EU, POSE_NN, POSE_NU, POSE_UU = 0, 1, 2, 3, 4, 5, 6

FREE = (0.0, 0.0, 0.0)  # no normal: all three coordinates are unknown


class Sources(NamedTuple):
    """Sources of ranges.

    anchors: (k, 3) east, north, altitude in metres; where distant (k,) bool is set, the unit direction towards it.
    variances: (k, 7) of the ranging, and ee, en, eu, nn, nu, uu of the anchor's pose, m²; (0, 7) = all 1.
    """

    anchors: Any
    distant: Any
    variances: Any


class Symmetric(NamedTuple):
    """A symmetric 3 × 3 matrix over east, north, up."""

    ee: float
    en: float
    eu: float
    nn: float
    nu: float
    uu: float


class Dilutions(NamedTuple):
    """Dilutions of precision at one point, and why they are what they are."""

    gdop: float
    pdop: float
    hdop: float
    vdop: float
    tdop: float
    reason: int


NO_COVARIANCE = Symmetric(math.inf, math.inf, math.inf, math.inf, math.inf, math.inf)


@scalar_kernel
def _weight(variances, a, east, north, up):
    """One over the variance of a range along a direction: the ranging's own and the anchor's pose seen along it."""
    if variances.shape[0] == 0:
        return 1.0
    ee, nn, uu = variances[a, POSE_EE], variances[a, POSE_NN], variances[a, POSE_UU]
    along = ee * east * east + nn * north * north + uu * up * up
    across = variances[a, POSE_EN] * east * north + variances[a, POSE_EU] * east * up
    across += variances[a, POSE_NU] * north * up
    return 1.0 / (variances[a, RANGE] + along + 2.0 * across)


@scalar_kernel
def _normal_matrix(point, sources, words, clock):
    """(count, sum of weights, Symmetric, mean direction) over the anchors set in words (uint64).

    With a clock its unknown is eliminated: directions count from their weighted mean, which the first one stands in
    for while they are summed, so that nearly parallel ones lose no digits. An anchor at the point itself has no
    direction and is left out.
    """
    anchors, distant, variances = sources
    count, total = 0, 0.0
    ee, en, eu, nn, nu, uu = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    sum_e, sum_n, sum_u = 0.0, 0.0, 0.0
    first_e, first_n, first_u = 0.0, 0.0, 0.0
    for a in range(anchors.shape[0]):
        if (words[a >> 6] >> np.uint64(a & 63)) & np.uint64(1) == 0:
            continue
        east, north, up = anchors[a, 0], anchors[a, 1], anchors[a, 2]
        if not distant[a]:
            east, north, up = east - point[0], north - point[1], up - point[2]
            distance = math.sqrt(east * east + north * north + up * up)
            if distance == 0.0:
                continue
            east, north, up = east / distance, north / distance, up / distance
        weight = _weight(variances, a, east, north, up)
        if clock:
            if count == 0:
                first_e, first_n, first_u = east, north, up
            east, north, up = east - first_e, north - first_n, up - first_u
        count += 1
        total += weight
        weighted_e, weighted_n, weighted_u = weight * east, weight * north, weight * up
        sum_e += weighted_e
        sum_n += weighted_n
        sum_u += weighted_u
        ee += weighted_e * east
        en += weighted_e * north
        eu += weighted_e * up
        nn += weighted_n * north
        nu += weighted_n * up
        uu += weighted_u * up
    if clock and count > 0:
        mean_e, mean_n, mean_u = sum_e / total, sum_n / total, sum_u / total
        ee -= sum_e * mean_e
        en -= sum_e * mean_n
        eu -= sum_e * mean_u
        nn -= sum_n * mean_n
        nu -= sum_n * mean_u
        uu -= sum_u * mean_u
        first_e, first_n, first_u = first_e + mean_e, first_n + mean_n, first_u + mean_u
    return count, total, Symmetric(ee, en, eu, nn, nu, uu), (first_e, first_n, first_u)


@scalar_kernel
def _inverse(matrix, least_pivot):
    """(inverse, whether it exists) of a Symmetric matrix, as L·D·Lᵀ."""
    ee, en, eu, nn, nu, uu = matrix
    if not ee > least_pivot:
        return NO_COVARIANCE, False
    down_n, down_u = en / ee, eu / ee
    pivot_n = nn - down_n * en
    if not pivot_n > least_pivot:
        return NO_COVARIANCE, False
    below = nu - down_n * eu
    across = below / pivot_n
    pivot_u = uu - down_u * eu - across * below
    if not pivot_u > least_pivot:
        return NO_COVARIANCE, False
    back_u = down_n * across - down_u
    q_uu = 1.0 / pivot_u
    q_nu, q_eu = -across * q_uu, back_u * q_uu
    q_nn = 1.0 / pivot_n - across * q_nu
    q_en = -down_n / pivot_n - across * q_eu
    q_ee = 1.0 / ee + down_n * down_n / pivot_n + back_u * q_eu
    return Symmetric(q_ee, q_en, q_eu, q_nn, q_nu, q_uu), True


@scalar_kernel
def _inverse_in_plane(matrix, normal, least_pivot):
    """(covariance, whether it exists) where only motion across a unit normal is unknown; 3 × 3 of rank 2."""
    ee, en, eu, nn, nu, uu = matrix
    n_e, n_n, n_u = normal
    # the axis that stands across the normal best, made to stand across it exactly
    if abs(n_e) < 0.8:
        a_e, a_n, a_u = 1.0 - n_e * n_e, -n_e * n_n, -n_e * n_u
    else:
        a_e, a_n, a_u = -n_n * n_e, 1.0 - n_n * n_n, -n_n * n_u
    length = math.sqrt(a_e * a_e + a_n * a_n + a_u * a_u)
    a_e, a_n, a_u = a_e / length, a_n / length, a_u / length
    b_e = n_n * a_u - n_u * a_n
    b_n = n_u * a_e - n_e * a_u
    b_u = n_e * a_n - n_n * a_e
    ma_e, ma_n, ma_u = ee * a_e + en * a_n + eu * a_u, en * a_e + nn * a_n + nu * a_u, eu * a_e + nu * a_n + uu * a_u
    mb_e, mb_n, mb_u = ee * b_e + en * b_n + eu * b_u, en * b_e + nn * b_n + nu * b_u, eu * b_e + nu * b_n + uu * b_u
    aa = a_e * ma_e + a_n * ma_n + a_u * ma_u
    ab = a_e * mb_e + a_n * mb_n + a_u * mb_u
    bb = b_e * mb_e + b_n * mb_n + b_u * mb_u
    if not aa > least_pivot:
        return NO_COVARIANCE, False
    pivot_b = bb - ab * ab / aa
    if not pivot_b > least_pivot:
        return NO_COVARIANCE, False
    q_bb = 1.0 / pivot_b
    q_ab = -ab / aa * q_bb
    q_aa = 1.0 / aa - ab / aa * q_ab
    # rows of T·Q for T = [a b]
    e_a, e_b = a_e * q_aa + b_e * q_ab, a_e * q_ab + b_e * q_bb
    n_a, n_b = a_n * q_aa + b_n * q_ab, a_n * q_ab + b_n * q_bb
    u_a, u_b = a_u * q_aa + b_u * q_ab, a_u * q_ab + b_u * q_bb
    return Symmetric(
        e_a * a_e + e_b * b_e,
        e_a * a_n + e_b * b_n,
        e_a * a_u + e_b * b_u,
        n_a * a_n + n_b * b_n,
        n_a * a_u + n_b * b_u,
        u_a * a_u + u_b * b_u,
    ), True


@scalar_kernel
def covariance_of_set(point, sources, words, kind, normal):
    """(covariance of position; variance of the clock; reason) at one point.

    point: (east, north, altitude); words: (w,) uint64, the visible set; normal: unit normal of the ground where only
    motion along it is unknown, (0, 0, 0) = all three coordinates. The clock's variance is 0 where none is solved for.
    """
    clock = kind != RANGING
    normal_e, normal_n, normal_u = normal
    on_ground = normal_e != 0.0 or normal_n != 0.0 or normal_u != 0.0
    unknowns = (2 if on_ground else 3) + (1 if clock else 0)
    count, total, matrix, mean = _normal_matrix(point, sources, words, clock)
    no_clock = math.inf if kind == PSEUDORANGE else 0.0
    if count < unknowns:
        return NO_COVARIANCE, no_clock, TOO_FEW
    if on_ground:
        q, exists = _inverse_in_plane(matrix, normal, total / SINGULAR_BEYOND)
    else:
        q, exists = _inverse(matrix, total / SINGULAR_BEYOND)
    if not exists or not (q.ee + q.nn + q.uu) * total <= SINGULAR_BEYOND:
        return NO_COVARIANCE, no_clock, SINGULAR
    if kind != PSEUDORANGE:
        return q, 0.0, OK
    east, north, up = mean
    spread = q.ee * east * east + q.nn * north * north + q.uu * up * up
    mixed = q.en * east * north + q.eu * east * up + q.nu * north * up
    return q, 1.0 / total + spread + 2.0 * mixed, OK


@scalar_kernel
def dop_of_set(point, sources, words, kind, normal):
    """Dilutions at one point; arguments as for covariance_of_set."""
    q, clock, reason = covariance_of_set(point, sources, words, kind, normal)
    horizontal = max(q.ee + q.nn, 0.0)
    vertical = max(q.uu, 0.0)
    position = horizontal + vertical
    return Dilutions(
        math.sqrt(position + clock),
        math.sqrt(position),
        math.sqrt(horizontal),
        math.sqrt(vertical),
        math.sqrt(clock),
        reason,
    )


@scalar_kernel
def _normal_of(normals, i):
    """Row i of normals (n, 3), the only row of (1, 3), or the zero that means none."""
    if normals.shape[0] == 0:
        return FREE
    if normals.shape[0] == 1:
        return normals[0, 0], normals[0, 1], normals[0, 2]
    return normals[i, 0], normals[i, 1], normals[i, 2]


@scalar_kernel
def _is_known(point, normal):
    """Whether a point and its normal are numbers: over unknown ground either may be NaN."""
    return not math.isnan(point[0] + point[1] + point[2] + normal[0] + normal[1] + normal[2])


@parallel_kernel
def dop_at_points(points_m, sources, mask, unknown, kind, normals, dop, reason):
    """Fill dop (n, 5) with GDOP, PDOP, HDOP, VDOP, TDOP and reason (n,) uint8 at points_m (n, 3).

    mask: (n, words) uint64, bit a of word a // 64 = anchor a is visible; unknown: (n,) bool, visibility not known: NaN.
    normals: (n, 3), (1, 3) for all, or (0, 3) = not bound to the ground.
    """
    for i in prange(points_m.shape[0]):
        point = (points_m[i, 0], points_m[i, 1], points_m[i, 2])
        normal = _normal_of(normals, i)
        if unknown[i] or not _is_known(point, normal):
            for j in range(5):
                dop[i, j] = np.nan
            reason[i] = UNKNOWN
        else:
            found = dop_of_set(point, sources, mask[i], kind, normal)
            dop[i, GDOP], dop[i, PDOP], dop[i, HDOP] = found.gdop, found.pdop, found.hdop
            dop[i, VDOP], dop[i, TDOP] = found.vdop, found.tdop
            reason[i] = found.reason


@parallel_kernel
def covariances_at_points(points_m, sources, mask, unknown, kind, normals, covariance, reason):
    """Fill covariance (n, 7) in columns EE to CLOCK; else as dop_at_points."""
    for i in prange(points_m.shape[0]):
        point = (points_m[i, 0], points_m[i, 1], points_m[i, 2])
        normal = _normal_of(normals, i)
        if unknown[i] or not _is_known(point, normal):
            for j in range(7):
                covariance[i, j] = np.nan
            reason[i] = UNKNOWN
        else:
            q, clock, why = covariance_of_set(point, sources, mask[i], kind, normal)
            covariance[i, EE], covariance[i, EN], covariance[i, EU] = q.ee, q.en, q.eu
            covariance[i, NN], covariance[i, NU], covariance[i, UU] = q.nn, q.nu, q.uu
            covariance[i, CLOCK] = clock
            reason[i] = why
