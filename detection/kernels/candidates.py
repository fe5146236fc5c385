"""A large set of ranges that meets in one point, found near the points where two circles, or three spheres, meet.

Ranges, sets and steps as in ``subsets``. A note: (table, sets, seen, tally) of all largest sets found so far; tally:
(size of them, how many, how many points' sets were seen, steps).
"""

import math

import numpy as np

from compiled.options import scalar_kernel

from .fits import FREE, NO_FIT, ONE, descend
from .misfits import meets
from .subsets import FOUND, bits, clashes, write_row

__all__ = ["COUNT", "SIZE", "STEPS", "candidates"]

SIZE, COUNT, SEEN, STEPS = 0, 1, 2, 3


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
def _settled(ranges, near, least, place, rules, work):
    """A consistent set of so many at least, grown from one near a point: the worst left out until all meet; 0 = none.

    (set, place, cost, steps).
    """
    flat, refine, studentised, _, _ = rules
    n = ranges[1].shape[0]
    cost, steps = 0.0, 0
    while bits(near) >= least:
        if refine:
            place, cost, _, rounds = descend(ranges, near, flat, place, FREE)
            steps += n * rounds
        steps += 3 * n
        if meets(ranges, near, flat, place, studentised, work):
            return near, place, cost, steps
        worst, most = -1, 0.0
        for i in range(n):
            if (near >> i) & 1 and work[1, i] > most:
                worst, most = i, work[1, i]
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
    n = ranges[1].shape[0]
    tally[STEPS] += n
    near = _consensus(ranges, place, slack)
    if bits(near) < max(tally[SIZE], rules[3]) or _is_among(near, seen, min(tally[SEEN], seen.shape[0])):
        return
    seen[tally[SEEN] % seen.shape[0]] = near
    tally[SEEN] += 1
    kept, settled, cost, steps = _settled(ranges, near, max(tally[SIZE], rules[3]), place, rules, work)
    tally[STEPS] += steps
    size = bits(kept)
    if kept == 0 or (size == tally[SIZE] and (_is_among(kept, sets, tally[COUNT]) or tally[COUNT] == sets.shape[0])):
        return
    row = np.zeros(FOUND)
    if rules[1]:
        places, steps = write_row(ranges, kept, rules, work, row)
        tally[STEPS] += steps
        if places == NO_FIT:
            return
    else:
        row[0], row[1], row[2], row[3] = cost, settled[0], settled[1], settled[2]
        row[4], row[8] = math.inf, ONE
    if size > tally[SIZE]:
        tally[SIZE], tally[COUNT] = size, 0
    table[tally[COUNT]] = row
    sets[tally[COUNT]] = kept
    tally[COUNT] += 1


@scalar_kernel
def _first(notes):
    """The first of the largest sets found so far; none yet: the empty one."""
    _, sets, _, tally = notes
    return sets[0] if tally[COUNT] else np.int64(0)


@scalar_kernel
def candidates(ranges, rules, slack, limit, notes):
    """Note the largest sets near the points where two circles, or three spheres, meet; whether all were looked at.

    Seed 000, 2D steps 3 and 4, and seed 001, 3D steps 2 to 4: every pair of circles gives two points, every circle of
    two spheres two with a third; the ranges within ``slack`` tolerances of a point are fitted and settled. After
    ``limit`` steps no other point is looked at. Where sets are fitted, points of ranges all in the first of the
    largest sets are passed over: a rival as large holds a range that it does not, and has points of its own.
    """
    anchors, measured, _, _, _ = ranges
    flat = rules[0]
    n = measured.shape[0]
    tally = notes[3]
    clash = clashes(ranges)
    tally[STEPS] += n * n
    work = np.zeros((2, n))
    for i in range(n):
        for j in range(i + 1, n):
            east, north, up = (
                anchors[j, 0] - anchors[i, 0],
                anchors[j, 1] - anchors[i, 1],
                anchors[j, 2] - anchors[i, 2],
            )
            apart = math.sqrt(east * east + north * north + up * up)
            if apart == 0.0 or (clash[i] >> j) & 1:
                continue
            east, north, up = east / apart, north / apart, up / apart
            along = (measured[i] * measured[i] - measured[j] * measured[j] + apart * apart) / (2.0 * apart)
            radius = math.sqrt(max(measured[i] * measured[i] - along * along, 0.0))
            at_e, at_n, at_u = anchors[i, 0] + along * east, anchors[i, 1] + along * north, anchors[i, 2] + along * up
            two = (np.int64(1) << i) | (np.int64(1) << j)
            if flat:
                if rules[1] and two & ~_first(notes) == 0:
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
                if rules[1] and (two | (np.int64(1) << k)) & ~_first(notes) == 0:
                    continue
                if tally[STEPS] > limit:
                    return False
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
                    _look_near(ranges, place, slack, rules, work, notes)
    return True
