"""What three ranges rule out: a fourth that passes neither of the two points where their spheres meet.

Where ranges meet, each is off by its tolerance at most. So the place lies in one of two small regions around the points
where three of them meet, no further from it than their tolerances times how badly the three directions tell places
apart; and a range that passes that far from both points cannot be kept together with the three.
"""

import math

import numpy as np

from compiled.options import scalar_kernel

from .linear_systems import Ranges
from .small_systems import Symmetric, apart, from_anchor, inverse, trace

__all__ = ["in_order", "ruled_out"]

# Directions turn on the way from the point to the place; as long as the region is that much smaller than the nearest
# range, they turn so little that twice the region is more than enough.
SMALL_REGION = 0.05
SURELY = 2.0


@scalar_kernel
def in_order(ranges, order):
    """The same Ranges, numbered by their position in an order."""
    anchors, measured, sigmas, tolerances, penalties = ranges
    return Ranges(anchors[order], measured[order], sigmas[order], tolerances[order], penalties[order])


@scalar_kernel
def _reach_m(ranges, place, three):
    """How far from where three ranges meet a place can lie at which each is within tolerance; inf = anywhere."""
    anchors, _, _, tolerances, _ = ranges
    ee, en, eu, nn, nu, uu = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    squared, nearest_m = 0.0, math.inf
    for i in three:
        east, north, up, distance = from_anchor(place, anchors, i)
        if distance <= 0.0:
            return math.inf
        east, north, up = east / distance, north / distance, up / distance
        ee, en, eu = ee + east * east, en + east * north, eu + east * up
        nn, nu, uu = nn + north * north, nu + north * up, uu + up * up
        squared += tolerances[i] * tolerances[i]
        nearest_m = min(nearest_m, distance)
    inverted, exists = inverse(Symmetric(ee, en, eu, nn, nu, uu))
    # the trace is not less than the largest eigenvalue, the square of how far one off in the ranges moves the place
    reach_m = SURELY * math.sqrt(trace(inverted) * squared) if exists else math.inf
    return reach_m if reach_m <= SMALL_REGION * nearest_m else math.inf


@scalar_kernel
def ruled_out(ranges):
    """(n, n, n) int64: of three ranges i < j < k, the set of those that cannot be kept together with all three."""
    anchors, measured, _, tolerances, _ = ranges
    n = measured.shape[0]
    table = np.zeros((n, n, n), np.int64)
    for i in range(n):
        for j in range(i + 1, n):
            east, north, up, length = apart(anchors, i, j)
            if length == 0.0:
                continue
            east, north, up = east / length, north / length, up / length
            along = (measured[i] * measured[i] - measured[j] * measured[j] + length * length) / (2.0 * length)
            radius2 = measured[i] * measured[i] - along * along
            if not radius2 > 0.0:
                continue
            at_e, at_n, at_u = anchors[i, 0] + along * east, anchors[i, 1] + along * north, anchors[i, 2] + along * up
            for k in range(j + 1, n):
                to_e, to_n, to_u = anchors[k, 0] - at_e, anchors[k, 1] - at_n, anchors[k, 2] - at_u
                off = to_e * east + to_n * north + to_u * up
                in_e, in_n, in_u = to_e - off * east, to_n - off * north, to_u - off * up
                distance = math.sqrt(in_e * in_e + in_n * in_n + in_u * in_u)
                if distance < 1e-9 * length:
                    continue
                in_e, in_n, in_u = in_e / distance, in_n / distance, in_u / distance
                forward = (radius2 - measured[k] * measured[k] + off * off + distance * distance) / (2.0 * distance)
                sideways2 = radius2 - forward * forward
                if not sideways2 > 0.0:
                    continue
                sideways = math.sqrt(sideways2)
                by_e, by_n, by_u = north * in_u - up * in_n, up * in_e - east * in_u, east * in_n - north * in_e
                first = (
                    at_e + forward * in_e + sideways * by_e,
                    at_n + forward * in_n + sideways * by_n,
                    at_u + forward * in_u + sideways * by_u,
                )
                # the other point is its mirror image in the plane of the three anchors, as well told apart
                reach_m = _reach_m(ranges, first, (i, j, k))
                if not math.isfinite(reach_m):
                    continue
                second = (
                    at_e + forward * in_e - sideways * by_e,
                    at_n + forward * in_n - sideways * by_n,
                    at_u + forward * in_u - sideways * by_u,
                )
                for other in range(n):
                    if other in (i, j, k):
                        continue
                    most_m = reach_m + tolerances[other]
                    _, _, _, to_first = from_anchor(first, anchors, other)
                    _, _, _, to_second = from_anchor(second, anchors, other)
                    if abs(to_first - measured[other]) > most_m and abs(to_second - measured[other]) > most_m:
                        table[i, j, k] |= np.int64(1) << other
    return table
