"""One dilution of precision out of the five, and the geometry in which none exists at any altitude."""

import math

import numpy as np

from compiled.options import scalar_kernel
from visibility.dilution.kernels.dop import FREE, GDOP, HDOP, OK, PDOP, TDOP, VDOP, dop_of_set

__all__ = ["GDOP", "HDOP", "PDOP", "TDOP", "VDOP", "dilutions", "never_a_fix"]

SAME_PLANE = 1e-9  # of the product of lengths


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
