"""Dilutions of precision at points from their visible sets (De Vivo et al., eqs. 16-18), and one out of the five.

Vectors are (east, north, up or altitude). A visible set is words (w,) uint64, bit a % 64 of word a // 64 for anchor a.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel
from visibility.dilution.kernels.normal_matrices import NO_COVARIANCE, inverse, inverse_in_plane, normal_matrix

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
    "covariance_of_set",
    "covariances_at_points",
    "dilutions",
    "dop_at_points",
    "dop_of_set",
    "never_a_fix",
]

# Kinds of range: clock known, clock solved for, clock differenced away.
RANGING, PSEUDORANGE, TDOA = 0, 1, 2

# Why a dilution is what it is.
OK, TOO_FEW, SINGULAR, UNKNOWN = 0, 1, 2, 3

# Sum of weights times trace of the position's covariance, n·PDOP² without weights: turning the world does not change
# it, and the rounding of the normal matrix (1e-16) is still 1e-4 of its least eigenvalue there.
SINGULAR_BEYOND = 1e12

# columns of dilutions; of covariances: the position's, then the clock's
GDOP, PDOP, HDOP, VDOP, TDOP = 0, 1, 2, 3, 4
EE, EN, EU, NN, NU, UU, CLOCK = 0, 1, 2, 3, 4, 5, 6

FREE = (0.0, 0.0, 0.0)  # no normal: all three coordinates are unknown
SAME_PLANE = 1e-9  # of the product of lengths


class Dilutions(NamedTuple):
    """Dilutions of precision at one point, and why they are what they are."""

    gdop: float
    pdop: float
    hdop: float
    vdop: float
    tdop: float
    reason: int


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
    count, total, matrix, mean = normal_matrix(point, sources, words, clock)
    no_clock = math.inf if kind == PSEUDORANGE else 0.0
    if count < unknowns:
        return NO_COVARIANCE, no_clock, TOO_FEW
    if on_ground:
        q, exists = inverse_in_plane(matrix, normal, total / SINGULAR_BEYOND)
    else:
        q, exists = inverse(matrix, total / SINGULAR_BEYOND)
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


@scalar_kernel
def dilutions(point, sources, words, kind, measure):
    """(the dilution asked for, PDOP) of a visible set at a point; +inf where there is no fix."""
    found = dop_of_set(point, sources, words, kind, FREE)
    if found.reason != OK:
        return math.inf, math.inf
    if measure == GDOP:
        return found.gdop, found.pdop
    if measure == PDOP:
        return found.pdop, found.pdop
    if measure == HDOP:
        return found.hdop, found.pdop
    return (found.vdop, found.pdop) if measure == VDOP else (found.tdop, found.pdop)


@scalar_kernel
def _in_one_plane(point, sources, words):
    """Whether the anchors of a set and the vertical over a point lie in one plane."""
    anchors, distant, _ = sources
    first_e, first_n = 0.0, 0.0
    for a in range(anchors.shape[0]):
        if (words[a >> 6] >> np.uint64(a & 63)) & np.uint64(1) == 0:
            continue
        east, north = anchors[a, 0], anchors[a, 1]
        if not distant[a]:
            east, north = east - point[0], north - point[1]
        if first_e == 0.0 and first_n == 0.0:
            first_e, first_n = east, north
        elif abs(first_e * north - first_n * east) > SAME_PLANE * math.hypot(first_e, first_n) * math.hypot(
            east, north
        ):
            return False
    return True


@scalar_kernel
def _on_one_line(sources, words):
    """Whether the anchors of a set lie on one line in space."""
    anchors, distant, _ = sources
    count, base = 0, 0
    along_e, along_n, along_u = 0.0, 0.0, 0.0
    for a in range(anchors.shape[0]):
        if (words[a >> 6] >> np.uint64(a & 63)) & np.uint64(1) == 0:
            continue
        if distant[a]:
            return False
        if count == 0:
            base = a
        count += 1
        east, north = anchors[a, 0] - anchors[base, 0], anchors[a, 1] - anchors[base, 1]
        up = anchors[a, 2] - anchors[base, 2]
        if along_e == 0.0 and along_n == 0.0 and along_u == 0.0:
            along_e, along_n, along_u = east, north, up
            continue
        across = math.hypot(along_n * up - along_u * north, along_u * east - along_e * up)
        across = math.hypot(across, along_e * north - along_n * east)
        lengths = math.sqrt((along_e**2 + along_n**2 + along_u**2) * (east**2 + north**2 + up**2))
        if across > SAME_PLANE * lengths:
            return False
    return True


@scalar_kernel
def never_a_fix(point, sources, words):
    """Whether a set gives no fix at any altitude over a point: on one line, or in one plane with the vertical there."""
    return _in_one_plane(point, sources, words) or _on_one_line(sources, words)
