"""What a set of ranges says at once: where planes through the circles in which spheres meet have their common point.

A set of ranges is the bits of an int64. flat: two dimensions, the altitude stays zero.
"""

from typing import Any, NamedTuple

from compiled.options import scalar_kernel

from .small_systems import Symmetric, apart, from_anchor

__all__ = ["Ranges", "linear_start", "range_pair_meets", "spread_of"]


class Ranges(NamedTuple):
    """Anchors (n, 3) with zero altitudes in 2D, then (n,) each: ranges, sigmas and tolerances, metres.

    penalties: −2·log of the odds that a range is occluded rather than clear, before it is measured.
    """

    anchors_m: Any
    ranges_m: Any
    sigmas_m: Any
    tolerances_m: Any
    penalties: Any


@scalar_kernel
def range_pair_meets(apart_m, range1_m, range2_m, tolerance_m):
    """Whether two circles or spheres meet: neither too far apart nor one inside the other (seed 000, step 3)."""
    return apart_m <= range1_m + range2_m + tolerance_m and apart_m >= abs(range1_m - range2_m) - tolerance_m


@scalar_kernel
def linear_start(ranges, kept, flat):
    """(normal matrix, right side, middle) of the planes through the circles in which pairs of spheres meet.

    Seed 000, 3D step 4: one row per pair, its unit normal; places count from the middle of the anchors, so that far
    coordinates lose no digits. Concentric pairs and pairs that do not meet give no plane.
    """
    anchors, measured, _, tolerances, _ = ranges
    n = measured.shape[0]
    middle_e, middle_n, middle_u, count = 0.0, 0.0, 0.0, 0
    for i in range(n):
        if (kept >> i) & 1:
            middle_e, middle_n, middle_u = middle_e + anchors[i, 0], middle_n + anchors[i, 1], middle_u + anchors[i, 2]
            count += 1
    middle_e, middle_n, middle_u = middle_e / count, middle_n / count, middle_u / count
    ee, en, eu, nn, nu, uu = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    right_e, right_n, right_u = 0.0, 0.0, 0.0
    for i in range(n):
        if not (kept >> i) & 1:
            continue
        for j in range(i + 1, n):
            if not (kept >> j) & 1:
                continue
            east, north, up, length = apart(anchors, i, j)
            tolerance = max(tolerances[i], tolerances[j])
            if length == 0.0 or not range_pair_meets(length, measured[i], measured[j], tolerance):
                continue
            east, north, up = east / length, north / length, up / length
            along = (measured[i] * measured[i] - measured[j] * measured[j] + length * length) / (2.0 * length)
            offset = along + (
                east * (anchors[i, 0] - middle_e) + north * (anchors[i, 1] - middle_n) + up * (anchors[i, 2] - middle_u)
            )
            ee, en, eu = ee + east * east, en + east * north, eu + east * up
            nn, nu, uu = nn + north * north, nu + north * up, uu + up * up
            right_e, right_n, right_u = right_e + east * offset, right_n + north * offset, right_u + up * offset
    if flat:
        uu += 0.5 * (ee + nn)
    return Symmetric(ee, en, eu, nn, nu, uu), (right_e, right_n, right_u), (middle_e, middle_n, middle_u)


@scalar_kernel
def spread_of(ranges, kept, place):
    """Mean squared miss of the sphere radii seen from a place, m²: how far out of a plane a mirrored pair lies."""
    anchors, measured, _, _, _ = ranges
    total, count = 0.0, 0
    for i in range(measured.shape[0]):
        if (kept >> i) & 1:
            east, north, up, _ = from_anchor(place, anchors, i)
            total += measured[i] * measured[i] - (east * east + north * north + up * up)
            count += 1
    return total / count
