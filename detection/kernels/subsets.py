"""Which largest set of ranges meets in one point: bounded by candidate points first, then exhaustively by exclusion.

Ranges and sets as in ``fits``. How a set is tested (rules): (flat, refine, studentised, least
kept, hint); hint: (3,) the rover's side of the anchors, NaN where it is not known.
"""

import math

import numpy as np

from terrain.kernel_options import scalar_kernel

from .fits import COLLINEAR, CROSSED, FREE, MIRRORED, NO_FIT, ONE, descend, fit, range_pair_meets, side_of
from .misfits import meets

__all__ = [
    "FOUND",
    "MOST",
    "bits",
    "bounded",
    "clashes",
    "exhaustive",
    "largest",
    "place_of",
]

# columns of the table of consistent sets
FOUND = 10  # cost, place (3), other cost, other place (3), places, penalty
MOST = 64  # sets kept of one size
# Squared residuals that a place on the hinted side may cost more: three sigma of the one number that it gives up.
SURE_OF_SIDE = 9.0


@scalar_kernel
def bits(kept):
    """How many are in a set."""
    count = 0
    while kept:
        kept &= kept - 1
        count += 1
    return count


@scalar_kernel
def place_of(ranges, kept, rules, work):
    """(in how many places the kept ranges meet on the rover's side, the first, its cost, the other, its cost)."""
    flat, refine, studentised, _, hint = rules
    places, place, cost, _, other, other_cost = fit(ranges, kept, flat, refine)
    if places in (NO_FIT, COLLINEAR):
        return NO_FIT, place, cost, other, other_cost
    side = side_of(place, other, hint) if places in (MIRRORED, CROSSED) else -1
    if places == CROSSED:
        # against a hint of the other side the ranges have to be sure before the one place that they fit is the answer
        if side > 0 and other_cost - cost <= SURE_OF_SIDE and meets(ranges, kept, flat, other, studentised, work):
            return ONE, other, other_cost, place, math.inf
        side, other_cost = -1, math.inf
    good = side <= 0 and meets(ranges, kept, flat, place, studentised, work)
    other_good = side >= 0 and meets(ranges, kept, flat, other, studentised, work)
    if good and other_good:
        return MIRRORED, place, cost, other, other_cost
    if good:
        return ONE, place, cost, other, math.inf if side else other_cost
    if other_good:
        return ONE, other, other_cost, place, math.inf if side else cost
    return NO_FIT, place, cost, other, other_cost


@scalar_kernel
def clashes(ranges):
    """Per range the set of those it cannot meet at all, by the triangle inequality."""
    anchors, measured, _, tolerances, _ = ranges
    n = measured.shape[0]
    clash = np.zeros(n, np.int64)
    for i in range(n):
        for j in range(i + 1, n):
            east, north, up = (
                anchors[j, 0] - anchors[i, 0],
                anchors[j, 1] - anchors[i, 1],
                anchors[j, 2] - anchors[i, 2],
            )
            apart = math.sqrt(east * east + north * north + up * up)
            if not range_pair_meets(apart, measured[i], measured[j], tolerances[i] + tolerances[j]):
                clash[i] |= np.int64(1) << j
                clash[j] |= np.int64(1) << i
    return clash


@scalar_kernel
def _consensus(ranges, place, slack):
    """The set of ranges within so many tolerances of a point."""
    anchors, measured, _, tolerances, _ = ranges
    near = np.int64(0)
    for i in range(measured.shape[0]):
        east, north, up = place[0] - anchors[i, 0], place[1] - anchors[i, 1], place[2] - anchors[i, 2]
        if abs(math.sqrt(east * east + north * north + up * up) - measured[i]) <= slack * tolerances[i]:
            near |= np.int64(1) << i
    return near


@scalar_kernel
def _settled(ranges, near, flat, place, rules, work):
    """A consistent set grown from one near a point: fitted, and the worst left out until all meet; 0 = none."""
    _, refine, studentised, least_kept, _ = rules
    for _ in range(ranges[1].shape[0]):
        if bits(near) < least_kept:
            return np.int64(0), place, math.inf
        cost = 0.0
        if refine:
            place, cost, _ = descend(ranges, near, flat, place, FREE)
        if meets(ranges, near, flat, place, studentised, work):
            return near, place, cost
        worst, most = -1, 0.0
        for i in range(ranges[1].shape[0]):
            if (near >> i) & 1 and work[1, i] > most:
                worst, most = i, work[1, i]
        if worst < 0:
            return np.int64(0), place, math.inf
        near &= ~(np.int64(1) << worst)
    return np.int64(0), place, math.inf


@scalar_kernel
def _better(ranges, near, best, rules, place, work):
    """The larger of the best set so far and what settles from the set near a point."""
    if bits(near) < max(bits(best[0]) + 1, rules[3]):
        return best
    grown, settled, cost = _settled(ranges, near, rules[0], place, rules, work)
    if bits(grown) <= bits(best[0]):
        return best
    if rules[1]:
        found, sided, sided_cost, _, _ = place_of(ranges, grown, rules, work)
        return (grown, sided, sided_cost) if found != NO_FIT else best
    return grown, settled, cost


@scalar_kernel
def bounded(ranges, rules, slack):
    """(largest set found, place, cost) among the points where two circles, or three spheres, meet.

    Seed 000, 2D steps 3 and 4, and seed 001, 3D steps 2 to 4: every pair of circles gives two points, every circle of
    two spheres two with a third; the ranges within ``slack`` tolerances of a point are fitted and settled.
    """
    anchors, measured, _, _, _ = ranges
    flat = rules[0]
    n = measured.shape[0]
    work = np.zeros((2, n))
    best = (np.int64(0), (0.0, 0.0, 0.0), math.inf)
    for i in range(n):
        for j in range(i + 1, n):
            east, north, up = (
                anchors[j, 0] - anchors[i, 0],
                anchors[j, 1] - anchors[i, 1],
                anchors[j, 2] - anchors[i, 2],
            )
            apart = math.sqrt(east * east + north * north + up * up)
            slack_m = ranges[3][i] + ranges[3][j]
            if apart == 0.0 or not range_pair_meets(apart, measured[i], measured[j], slack_m):
                continue
            east, north, up = east / apart, north / apart, up / apart
            along = (measured[i] * measured[i] - measured[j] * measured[j] + apart * apart) / (2.0 * apart)
            radius = math.sqrt(max(measured[i] * measured[i] - along * along, 0.0))
            at_e, at_n, at_u = anchors[i, 0] + along * east, anchors[i, 1] + along * north, anchors[i, 2] + along * up
            if flat:
                for side in (1.0, -1.0):
                    place = (at_e + side * radius * north, at_n - side * radius * east, 0.0)
                    best = _better(ranges, _consensus(ranges, place, slack), best, rules, place, work)
                continue
            for k in range(j + 1, n):
                to_e, to_n, to_u = anchors[k, 0] - at_e, anchors[k, 1] - at_n, anchors[k, 2] - at_u
                off = to_e * east + to_n * north + to_u * up
                in_e, in_n, in_u = to_e - off * east, to_n - off * north, to_u - off * up
                distance = math.sqrt(in_e * in_e + in_n * in_n + in_u * in_u)
                if distance < 1e-9 * apart:
                    continue
                in_e, in_n, in_u = in_e / distance, in_n / distance, in_u / distance
                # within the plane of the circle, sphere k is a circle too
                disc2 = measured[k] * measured[k] - off * off
                forward = (radius * radius - disc2 + distance * distance) / (2.0 * distance)
                sideways2 = radius * radius - forward * forward
                if sideways2 < 0.0:
                    forward = min(max(forward, -radius), radius)
                sideways = math.sqrt(max(sideways2, 0.0))
                across_e, across_n, across_u = (
                    north * in_u - up * in_n,
                    up * in_e - east * in_u,
                    east * in_n - north * in_e,
                )
                for side in (1.0, -1.0):
                    place = (
                        at_e + forward * in_e + side * sideways * across_e,
                        at_n + forward * in_n + side * sideways * across_n,
                        at_u + forward * in_u + side * sideways * across_u,
                    )
                    best = _better(ranges, _consensus(ranges, place, slack), best, rules, place, work)
    return best


@scalar_kernel
def _clash_within(kept, clash):
    together = np.int64(0)
    for i in range(clash.shape[0]):
        if (kept >> i) & 1:
            together |= clash[i] & kept
    return together != 0


@scalar_kernel
def exhaustive(ranges, rules, order, leave_out, limit, found, sets):
    """Test all sets that leave out so many; (consistent sets written, sets tried, whether all were tested).

    order: (n,) ranges by error, largest first, so that the likeliest exclusions come first (seed 000, 3D step 8).
    found: (MOST, FOUND) table and sets: (MOST,) the kept bits, written in the order found.
    """
    n = ranges[1].shape[0]
    everyone = (np.int64(1) << n) - 1
    clash = clashes(ranges)
    work = np.zeros((2, n))
    count, tried = 0, 0
    chosen = (np.int64(1) << leave_out) - 1
    while chosen <= everyone:
        out, left, position = np.int64(0), chosen, 0
        while left:
            if left & 1:
                out |= np.int64(1) << order[position]
            left >>= 1
            position += 1
        kept = everyone & ~out
        if not _clash_within(kept, clash):
            if tried >= limit:
                return count, tried, False
            tried += 1
            places, place, cost, other, other_cost = place_of(ranges, kept, rules, work)
            if places != NO_FIT and count < MOST:
                penalty = 0.0
                for i in range(n):
                    if (out >> i) & 1:
                        penalty += ranges[4][i]
                found[count, 0], found[count, 1], found[count, 2], found[count, 3] = cost, place[0], place[1], place[2]
                found[count, 4] = other_cost
                found[count, 5], found[count, 6], found[count, 7] = other
                found[count, 8], found[count, 9] = places, penalty
                sets[count] = kept
                count += 1
        if leave_out == 0:
            break
        # the next number with as many bits (Gosper)
        lowest = chosen & -chosen
        ripple = chosen + lowest
        chosen = (((ripple ^ chosen) >> 2) // lowest) | ripple
    return count, tried, True


@scalar_kernel
def largest(ranges, rules, order, leave_out, limit, found, sets):
    """The same for the least number left out with which any set meets, from the first of leave_out to the last."""
    tried = 0
    for out in range(leave_out[0], leave_out[1] + 1):
        count, more, complete = exhaustive(ranges, rules, order, out, limit - tried, found, sets)
        tried += more
        if count > 0 or not complete:
            return count, tried, complete
    return 0, tried, True
