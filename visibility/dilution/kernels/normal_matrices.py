"""Normal matrices over the visible anchors of a point, and their inverses (De Vivo et al., eqs. 16-18).

Vectors are (east, north, up or altitude). A visible set is words (w,) uint64, bit a % 64 of word a // 64 for anchor a.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from compiled.options import scalar_kernel

__all__ = ["NO_COVARIANCE", "Sources", "Symmetric", "inverse", "inverse_in_plane", "normal_matrix"]

# columns of variances: the ranging's, then the pose's
RANGE, POSE_EE, POSE_EN, POSE_EU, POSE_NN, POSE_NU, POSE_UU = 0, 1, 2, 3, 4, 5, 6


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
def normal_matrix(point, sources, words, clock):
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
def inverse(matrix, least_pivot):
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
def inverse_in_plane(matrix, normal, least_pivot):
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
