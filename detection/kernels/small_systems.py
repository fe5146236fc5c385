"""Vectors from anchors, and symmetric 3 × 3 systems over them: solved, inverted, and their weakest axis."""

import math
from typing import NamedTuple

from compiled.options import scalar_kernel

__all__ = [
    "NOTHING",
    "Symmetric",
    "apart",
    "from_anchor",
    "inverse",
    "quadratic_form",
    "solved",
    "trace",
    "weakest_axis",
    "without_axis",
]


class Symmetric(NamedTuple):
    """A symmetric 3 × 3 matrix over east, north, up."""

    ee: float
    en: float
    eu: float
    nn: float
    nu: float
    uu: float


NOTHING = Symmetric(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@scalar_kernel
def apart(anchors, i, j):
    """(east, north, up, length) from anchor i to anchor j of anchors (n, 3)."""
    east, north, up = anchors[j, 0] - anchors[i, 0], anchors[j, 1] - anchors[i, 1], anchors[j, 2] - anchors[i, 2]
    return east, north, up, math.sqrt(east * east + north * north + up * up)


@scalar_kernel
def from_anchor(place, anchors, i):
    """(east, north, up, length) from anchor i of anchors (n, 3) to a place."""
    east, north, up = place[0] - anchors[i, 0], place[1] - anchors[i, 1], place[2] - anchors[i, 2]
    return east, north, up, math.sqrt(east * east + north * north + up * up)


@scalar_kernel
def trace(matrix):
    """The sum of a matrix' diagonal."""
    return matrix.ee + matrix.nn + matrix.uu


@scalar_kernel
def inverse(matrix):
    """(inverse, whether it exists) by cofactors; a determinant of rounding size does not count."""
    ee, en, eu, nn, nu, uu = matrix
    cofactor_ee, cofactor_en, cofactor_eu = nn * uu - nu * nu, eu * nu - en * uu, en * nu - eu * nn
    determinant = ee * cofactor_ee + en * cofactor_en + eu * cofactor_eu
    scale = (ee + nn + uu) / 3.0
    if not determinant > 1e-13 * scale * scale * scale:
        return NOTHING, False
    over = 1.0 / determinant
    return Symmetric(
        cofactor_ee * over,
        cofactor_en * over,
        cofactor_eu * over,
        (ee * uu - eu * eu) * over,
        (en * eu - ee * nu) * over,
        (ee * nn - en * en) * over,
    ), True


@scalar_kernel
def solved(inverted, east, north, up):
    """The inverse times a vector."""
    ee, en, eu, nn, nu, uu = inverted
    return ee * east + en * north + eu * up, en * east + nn * north + nu * up, eu * east + nu * north + uu * up


@scalar_kernel
def quadratic_form(matrix, east, north, up):
    """A vector's squared length in a matrix."""
    ee, en, eu, nn, nu, uu = matrix
    return (
        ee * east * east
        + nn * north * north
        + uu * up * up
        + 2.0 * (en * east * north + eu * east * up + nu * north * up)
    )


@scalar_kernel
def weakest_axis(matrix):
    """(unit eigenvector of the least eigenvalue, least and middle eigenvalue over the largest), in closed form."""
    ee, en, eu, nn, nu, uu = matrix
    mean = (ee + nn + uu) / 3.0
    off = en * en + eu * eu + nu * nu
    spread = math.sqrt(((ee - mean) ** 2 + (nn - mean) ** 2 + (uu - mean) ** 2 + 2.0 * off) / 6.0)
    if not spread > 1e-12 * mean:
        return 0.0, 0.0, 1.0, 1.0, 1.0
    a, b, c = (ee - mean) / spread, (nn - mean) / spread, (uu - mean) / spread
    d, e, f = en / spread, eu / spread, nu / spread
    half_determinant = (a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e)) / 2.0
    angle = math.acos(min(max(half_determinant, -1.0), 1.0)) / 3.0
    largest = mean + 2.0 * spread * math.cos(angle)
    least = mean + 2.0 * spread * math.cos(angle + 2.0 * math.pi / 3.0)
    middle = max(3.0 * mean - largest - least, 0.0) / largest
    a, b, c = ee - least, nn - least, uu - least
    # rows of the shifted matrix lie across its null vector: the longest of their cross products is steadiest
    east1, north1, up1 = en * nu - eu * b, eu * en - a * nu, a * b - en * en
    east2, north2, up2 = en * c - eu * nu, eu * eu - a * c, a * nu - en * eu
    east3, north3, up3 = b * c - nu * nu, nu * eu - en * c, en * nu - b * eu
    length1 = east1 * east1 + north1 * north1 + up1 * up1
    length2 = east2 * east2 + north2 * north2 + up2 * up2
    length3 = east3 * east3 + north3 * north3 + up3 * up3
    if length2 > length1:
        east1, north1, up1, length1 = east2, north2, up2, length2
    if length3 > length1:
        east1, north1, up1, length1 = east3, north3, up3, length3
    if not length1 > 0.0:
        return 0.0, 0.0, 1.0, max(least, 0.0) / largest, middle
    over = 1.0 / math.sqrt(length1)
    return east1 * over, north1 * over, up1 * over, max(least, 0.0) / largest, middle


@scalar_kernel
def without_axis(matrix, axis):
    """The matrix cut down to the plane across a unit vector, and as stiff along it as it ever is; zeros cut nothing."""
    ee, en, eu, nn, nu, uu = matrix
    axis_e, axis_n, axis_u = axis
    across_e, across_n, across_u = solved(matrix, axis_e, axis_n, axis_u)
    along = across_e * axis_e + across_n * axis_n + across_u * axis_u + ee + nn + uu
    return Symmetric(
        ee - 2.0 * across_e * axis_e + along * axis_e * axis_e,
        en - across_e * axis_n - across_n * axis_e + along * axis_e * axis_n,
        eu - across_e * axis_u - across_u * axis_e + along * axis_e * axis_u,
        nn - 2.0 * across_n * axis_n + along * axis_n * axis_n,
        nu - across_n * axis_u - across_u * axis_n + along * axis_n * axis_u,
        uu - 2.0 * across_u * axis_u + along * axis_u * axis_u,
    )
