"""Which largest set of ranges meets in one point: all sets there are, by exclusion, within so much work.

Work is counted in steps: a step looks at one range once. Ranges and sets as in ``fits``.
"""

import math
from typing import NamedTuple

import numpy as np

from compiled.options import scalar_kernel

from .fits import COLLINEAR, CROSSED, MIRRORED, NO_FIT, ONE, fit, side_of
from .linear_systems import range_pair_meets
from .misfits import meets
from .small_systems import apart

__all__ = [
    "FOUND",
    "MOST",
    "Limits",
    "Rules",
    "bits",
    "clashes",
    "exhaustive",
    "largest",
    "place_of",
    "write_row",
]

# columns of the table of consistent sets
COST, EAST, NORTH, UP, OTHER_COST, OTHER_EAST, OTHER_NORTH, OTHER_UP, PLACES, PENALTY = range(10)
FOUND = 10
MOST = 64  # sets kept of one size
PAIRS_A_STEP = 8  # pairs of kept ranges are looked up in the time that one range is looked at
# Squared residuals that a place on the hinted side may cost more: three sigma of the one number that it gives up.
SURE_OF_SIDE = 9.0


class Rules(NamedTuple):
    """How a set is tested. flat: 2D. refine: Gauss-Newton after the linear system. studentised: see ``statistics``.

    hint_m: a point on the rover's side of the anchors, NaN along axes where that is not known.
    """

    flat: bool
    refine: bool
    studentised: bool
    least_kept: int
    hint_m: tuple[float, float, float]


class Limits(NamedTuple):
    """How many sets may be tried, in how many steps."""

    sets: int
    steps: int


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
    """(in how many places the kept ranges meet on the rover's side, one, its cost, the other, its cost, steps)."""
    flat, refine, studentised, _, hint = rules
    places, place, cost, other, other_cost, rounds = fit(ranges, kept, flat, refine)
    n = ranges.ranges_m.shape[0]
    steps = n * (n // 2 + rounds + 4)  # pairs in the linear system, descents, and whether all meet at both places
    if places in (NO_FIT, COLLINEAR):
        return NO_FIT, place, cost, other, other_cost, steps
    side = side_of(place, other, hint) if places in (MIRRORED, CROSSED) else -1
    if places == CROSSED:
        # against a hint of the other side the ranges have to be sure before the one place that they fit is the answer
        if side > 0 and other_cost - cost <= SURE_OF_SIDE and meets(ranges, kept, flat, other, studentised, work):
            return ONE, other, other_cost, place, math.inf, steps
        side, other_cost = -1, math.inf
    good = side <= 0 and meets(ranges, kept, flat, place, studentised, work)
    other_good = side >= 0 and meets(ranges, kept, flat, other, studentised, work)
    if good and other_good:
        return MIRRORED, place, cost, other, other_cost, steps
    if good:
        return ONE, place, cost, other, math.inf if side else other_cost, steps
    if other_good:
        return ONE, other, other_cost, place, math.inf if side else cost, steps
    return NO_FIT, place, cost, other, other_cost, steps


@scalar_kernel
def clashes(ranges):
    """Per range the set of those it cannot meet at all, by the triangle inequality."""
    anchors, measured, _, tolerances, _ = ranges
    n = measured.shape[0]
    clash = np.zeros(n, np.int64)
    for i in range(n):
        for j in range(i + 1, n):
            _, _, _, length = apart(anchors, i, j)
            if not range_pair_meets(length, measured[i], measured[j], tolerances[i] + tolerances[j]):
                clash[i] |= np.int64(1) << j
                clash[j] |= np.int64(1) << i
    return clash


@scalar_kernel
def write_row(ranges, kept, rules, work, found):
    """(in how many places a set meets, steps); where it does, found: (FOUND,) is what there is to say of it."""
    places, place, cost, other, other_cost, steps = place_of(ranges, kept, rules, work)
    if places != NO_FIT:
        penalty = 0.0
        for i in range(ranges.ranges_m.shape[0]):
            if not (kept >> i) & 1:
                penalty += ranges.penalties[i]
        found[COST], found[OTHER_COST] = cost, other_cost
        found[EAST], found[NORTH], found[UP] = place
        found[OTHER_EAST], found[OTHER_NORTH], found[OTHER_UP] = other
        found[PLACES], found[PENALTY] = places, penalty
    return places, steps


@scalar_kernel
def _clashes_by_position(clash, order):
    """The same sets with ranges numbered by their position in an order."""
    n = order.shape[0]
    by_position = np.zeros(n, np.int64)
    for p in range(n):
        for q in range(n):
            if (clash[order[p]] >> order[q]) & 1:
                by_position[p] |= np.int64(1) << q
    return by_position


@scalar_kernel
def _banned_by_three(table, i, keeps):
    """(what three kept ranges rule out of which i, below all others, is one; steps): by position."""
    n = table.shape[0]
    bans, pairs = np.int64(0), 0
    for j in range(i + 1, n):
        if (keeps >> j) & 1:
            for k in range(j + 1, n):
                if (keeps >> k) & 1:
                    bans |= table[i, j, k]
                    pairs += 1
    return bans, pairs // PAIRS_A_STEP


@scalar_kernel
def exhaustive(ranges, rules, order, leave_out, limits, found, sets, table):
    """Test all sets that leave out so many and may meet; (sets written, sets tried, steps, whether all).

    order: (n,) ranges by error, largest first, so that the likeliest exclusions come first (seed 000, 3D step 8).
    limits: Limits. found: (MOST, FOUND) table and sets: (MOST,) the kept bits, written in the order found. table: of
    ``triples.ruled_out`` over the ranges in that order, or (0, 0, 0): unknown.

    From the last position to the first each range is kept, then left out; whatever clashes with one that is kept, or
    with three that are, has to be left out, so that a branch ends where more would have to be than may.
    """
    n = ranges.ranges_m.shape[0]
    clash = _clashes_by_position(clashes(ranges), order)
    work, row = (np.zeros(n), np.zeros(n)), np.zeros(FOUND)
    count, tried, steps = 0, 0, n * n
    # before the position p is decided, at index p + 1: how many are still to be left out, and which of all have to be
    branch, outs, banned = np.zeros(n + 1, np.int64), np.zeros(n + 1, np.int64), np.zeros(n + 1, np.int64)
    keeps = np.zeros(n + 1, np.int64)  # by position
    outs[n] = leave_out
    out = np.int64(0)  # by range, not by position
    everyone = (np.int64(1) << n) - 1
    p = n
    while p <= n:
        if p == 0:
            if tried >= limits.sets:
                return count, tried, steps, False
            tried += 1
            places, more = write_row(ranges, everyone & ~out, rules, work, row)
            steps += more
            if places != NO_FIT and count < MOST:
                found[count] = row
                sets[count] = everyone & ~out
                count += 1
            p = 1
            continue
        steps += 1
        if steps > limits.steps:
            return count, tried, steps, False
        i, below = p - 1, (np.int64(1) << (p - 1)) - 1
        bit = np.int64(1) << order[i]
        branch[p] += 1
        if branch[p] == 1:
            bans = banned[p] | clash[i]
            may = outs[p] <= i and not (banned[p] >> i) & 1 and bits(bans & below) <= outs[p]
            if may and table.shape[0] > 0:
                more_bans, looked = _banned_by_three(table, i, keeps[p])
                bans |= more_bans
                steps += looked
                may = bans & keeps[p] == 0 and bits(bans & below) <= outs[p]
            if may:
                outs[i], banned[i], keeps[i] = outs[p], bans, keeps[p] | (np.int64(1) << i)
                branch[i] = 0
                p = i
        elif branch[p] == 2:
            if outs[p] > 0 and bits(banned[p] & below) <= outs[p] - 1:
                out |= bit
                outs[i], banned[i], keeps[i] = outs[p] - 1, banned[p], keeps[p]
                branch[i] = 0
                p = i
        else:
            out &= ~bit
            branch[p] = 0
            p += 1
    return count, tried, steps, True


@scalar_kernel
def _pairs_apart(clash):
    """How many pairs clash that share no range: of each at least one has to be left out."""
    pairs, taken = 0, np.int64(0)
    for i in range(clash.shape[0]):
        if (taken >> i) & 1:
            continue
        for j in range(i + 1, clash.shape[0]):
            if (clash[i] >> j) & 1 and not (taken >> j) & 1:
                taken |= (np.int64(1) << i) | (np.int64(1) << j)
                pairs += 1
                break
    return pairs


@scalar_kernel
def largest(ranges, rules, order, leave_out, limits, found, sets, table):
    """The same for the least number left out with which any set meets, from the first of leave_out to the last.

    (sets written, sets tried, steps, whether all were tested, how many they leave out: none that leaves out fewer
    meets).
    """
    first_out, last_out = leave_out
    tried, steps = 0, 0
    for out in range(max(first_out, _pairs_apart(clashes(ranges))), last_out + 1):
        left = Limits(limits.sets - tried, limits.steps - steps)
        count, more, more_steps, complete = exhaustive(ranges, rules, order, out, left, found, sets, table)
        tried += more
        steps += more_steps
        if count > 0 or not complete:
            return count, tried, steps, complete, out
    return 0, tried, steps, True, last_out + 1
