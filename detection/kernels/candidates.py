"""A large set of ranges that meets in one point, found near the points where two circles, or three spheres, meet.

Ranges, sets and steps as in ``subsets``.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from compiled.options import scalar_kernel

from .fits import FREE, NO_FIT, ONE, descend
from .misfits import meets
from .small_systems import apart, from_anchor
from .subsets import COST, EAST, FOUND, NORTH, OTHER_COST, PLACES, UP, bits, clashes, write_row

__all__ = ["COUNT", "SIZE", "STEPS", "Notes", "candidates"]

# of the tally: size of the largest sets, how many, how many points' sets were seen, steps
SIZE, COUNT, SEEN, STEPS = 0, 1, 2, 3


class Notes(NamedTuple):
    """All largest sets found so far: their rows (MOST, FOUND), their bits (MOST,); bits seen (MOST,), tally (4,)."""

    table: Any
    sets: Any
    seen: Any
    tally: Any


@scalar_kernel
def _consensus(ranges, place, slack):
    """The set of ranges within so many tolerances of a point."""
    anchors, measured, _, tolerances, _ = ranges
    near = np.int64(0)
    for i in range(measured.shape[0]):
        _, _, _, distance = from_anchor(place, anchors, i)
        if abs(distance - measured[i]) <= slack * tolerances[i]:
            near |= np.int64(1) << i
    return near


@scalar_kernel
def _settled(ranges, near, least, place, rules, work):
    """A consistent set of so many at least, grown from one near a point: the worst left out until all meet; 0 = none.

    (set, place, cost, steps).
    """
    flat, refine, studentised, _, _ = rules
    _, statistic = work
    n = statistic.shape[0]
    cost, steps = 0.0, 0
    while bits(near) >= least:
        if refine:
            place, cost, rounds = descend(ranges, near, flat, place, FREE)
            steps += n * rounds
        steps += 3 * n
        if meets(ranges, near, flat, place, studentised, work):
            return near, place, cost, steps
        worst, most = -1, 0.0
        for i in range(n):
            if (near >> i) & 1 and statistic[i] > most:
                worst, most = i, statistic[i]
        if worst < 0:
            break
        near &= ~(np.int64(1) << worst)
    return np.int64(0), place, math.inf, steps


@scalar_kernel
def _is_among(one, sets, count):
    for k in range(count):  # noqa: SIM110 - numba compiles no generators here
        if sets[k] == one:
            return True
    return False


@scalar_kernel
def _look_near(ranges, place, slack, rules, work, notes):
    """Note what settles from the ranges near a point, where that is as large as the largest set so far, and new."""
    table, sets, seen, tally = notes
    n = ranges.ranges_m.shape[0]
    tally[STEPS] += n
    near = _consensus(ranges, place, slack)
    if bits(near) < max(tally[SIZE], rules.least_kept) or _is_among(near, seen, min(tally[SEEN], seen.shape[0])):
        return
    seen[tally[SEEN] % seen.shape[0]] = near
    tally[SEEN] += 1
    kept, settled, cost, steps = _settled(ranges, near, max(tally[SIZE], rules.least_kept), place, rules, work)
    tally[STEPS] += steps
    size = bits(kept)
    if kept == 0 or (size == tally[SIZE] and (_is_among(kept, sets, tally[COUNT]) or tally[COUNT] == sets.shape[0])):
        return
    row = np.zeros(FOUND)
    if rules.refine:
        places, steps = write_row(ranges, kept, rules, work, row)
        tally[STEPS] += steps
        if places == NO_FIT:
            return
    else:
        row[COST], row[OTHER_COST], row[PLACES] = cost, math.inf, ONE
        row[EAST], row[NORTH], row[UP] = settled
    if size > tally[SIZE]:
        tally[SIZE], tally[COUNT] = size, 0
    table[tally[COUNT]] = row
    sets[tally[COUNT]] = kept
    tally[COUNT] += 1


@scalar_kernel
def _first(notes):
    """The first of the largest sets found so far; none yet: the empty one."""
    return notes.sets[0] if notes.tally[COUNT] else np.int64(0)


@scalar_kernel
def candidates(ranges, rules, slack, limit, notes):
    """Note the largest sets near the points where two circles, or three spheres, meet; whether all were looked at.

    Seed 000, 2D steps 3 and 4, and seed 001, 3D steps 2 to 4: every pair of circles gives two points, every circle of
    two spheres two with a third; the ranges within ``slack`` tolerances of a point are fitted and settled. After
    ``limit`` steps no other point is looked at. Where sets are fitted, points of ranges all in the first of the
    largest sets are passed over: a rival as large holds a range that it does not, and has points of its own.
    """
    anchors, measured, _, _, _ = ranges
    flat = rules.flat
    n = measured.shape[0]
    tally = notes.tally
    clash = clashes(ranges)
    tally[STEPS] += n * n
    work = (np.zeros(n), np.zeros(n))
    for i in range(n):
        for j in range(i + 1, n):
            east, north, up, length = apart(anchors, i, j)
            if length == 0.0 or (clash[i] >> j) & 1:
                continue
            east, north, up = east / length, north / length, up / length
            along = (measured[i] * measured[i] - measured[j] * measured[j] + length * length) / (2.0 * length)
            radius = math.sqrt(max(measured[i] * measured[i] - along * along, 0.0))
            at_e, at_n, at_u = anchors[i, 0] + along * east, anchors[i, 1] + along * north, anchors[i, 2] + along * up
            two = (np.int64(1) << i) | (np.int64(1) << j)
            if flat:
                if rules.refine and two & ~_first(notes) == 0:
                    continue
                if tally[STEPS] > limit:
                    return False
                for side in (1.0, -1.0):
                    place = (at_e + side * radius * north, at_n - side * radius * east, 0.0)
                    _look_near(ranges, place, slack, rules, work, notes)
                continue
            for k in range(j + 1, n):
                tally[STEPS] += 1
                if ((clash[i] | clash[j]) >> k) & 1:
                    continue
                if rules.refine and (two | (np.int64(1) << k)) & ~_first(notes) == 0:
                    continue
                if tally[STEPS] > limit:
                    return False
                to_e, to_n, to_u = anchors[k, 0] - at_e, anchors[k, 1] - at_n, anchors[k, 2] - at_u
                off = to_e * east + to_n * north + to_u * up
                in_e, in_n, in_u = to_e - off * east, to_n - off * north, to_u - off * up
                distance = math.sqrt(in_e * in_e + in_n * in_n + in_u * in_u)
                if distance < 1e-9 * length:
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
                    _look_near(ranges, place, slack, rules, work, notes)
    return True
