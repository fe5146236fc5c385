"""Symmetric 3 × 3 systems, six numbers (ee, en, eu, nn, nu, uu) each: solved, inverted, and their weakest axis."""

import math

from compiled.options import scalar_kernel

__all__ = ["inverse", "quadratic_form", "solved", "weakest_axis", "without_axis"]


@scalar_kernel
def inverse(matrix):
    """(inverse, whether it exists) by cofactors; a determinant of rounding size does not count."""
    ee, en, eu, nn, nu, uu = matrix
    cofactor_ee, cofactor_en, cofactor_eu = nn * uu - nu * nu, eu * nu - en * uu, en * nu - eu * nn
    determinant = ee * cofactor_ee + en * cofactor_en + eu * cofactor_eu
    scale = (ee + nn + uu) / 3.0
    if not determinant > 1e-13 * scale * scale * scale:
        return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), False
    over = 1.0 / determinant
    return (
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
    across_e, across_n, across_u = solved(matrix, axis[0], axis[1], axis[2])
    along = across_e * axis[0] + across_n * axis[1] + across_u * axis[2] + ee + nn + uu
    return (
        ee - 2.0 * across_e * axis[0] + along * axis[0] * axis[0],
        en - across_e * axis[1] - across_n * axis[0] + along * axis[0] * axis[1],
        eu - across_e * axis[2] - across_u * axis[0] + along * axis[0] * axis[2],
        nn - 2.0 * across_n * axis[1] + along * axis[1] * axis[1],
        nu - across_n * axis[2] - across_u * axis[1] + along * axis[1] * axis[2],
        uu - 2.0 * across_u * axis[2] + along * axis[2] * axis[2],
    )
