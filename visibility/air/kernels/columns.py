"""The column of air over a post: between which altitudes each anchor is in sight there, and what was found.

A column is a table (9, anchors). Anchor a is in sight at altitude z where z ≥ table[SURE, a], z ≤ table[TOP, a] and z
is not between GAP_FROM and GAP_TO (too near the anchor). From MAYBE to SURE it is not known. EAST and NORTH lead from
the column to the anchor, AWAY is their length and LEVEL the anchor's altitude; a distant one, whose direction is the
same everywhere, has AWAY 0 and LEVEL +inf. Visible sets are bits in uint64 words, bit a % 64 of word a // 64 for
anchor a.

A column is judged stretch by stretch from the ceiling to the ground; ``Findings`` take down what the air is like.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from compiled.options import scalar_kernel
from visibility.sight.kernels.reach import upper_bounds

__all__ = [
    "ABOVE",
    "CLOSED_AT_CEILING",
    "COLUMN_ROWS",
    "EVERYWHERE",
    "FLYABLE",
    "NOTHING_FOUND",
    "NOT_FLYABLE",
    "NOWHERE",
    "OUTSIDE",
    "UNDECIDED",
    "UNKNOWN",
    "Column",
    "Findings",
    "Question",
    "conclude",
    "count_of",
    "fill_column",
    "next_split",
    "note",
    "same_set",
    "set_between",
    "steepness",
]

# what a stretch of air is like
NOT_FLYABLE, FLYABLE, UNKNOWN, UNDECIDED = 0, 1, 255, 2

# what a column is like; UNKNOWN too
NOWHERE, EVERYWHERE, ABOVE, CLOSED_AT_CEILING, OUTSIDE = 0, 1, 2, 3, 4

# of the stretch before: flyable, unknown, not flyable
RUN_FLYABLE, RUN_UNKNOWN, RUN_CLOSED = 0, 1, 2


class Findings(NamedTuple):
    """What was found of a column so far: whether any stretch is flyable, and whether any is unknown.

    safe_above_m: upper end of the first stretch that is not flyable for certain; first_code: its code. intervals:
    separate no-flight intervals; run: what the stretch before was like.
    """

    flyable: bool
    unknown: bool
    safe_above_m: float
    first_code: int
    intervals: int
    run: int


class Column(NamedTuple):
    """A column's answer: altitude, altitude above which all is flyable for certain, state, no-flight intervals."""

    altitude_m: float
    safe_above_m: float
    state: int
    intervals: int


NOTHING_FOUND = Findings(False, False, -math.inf, FLYABLE, 0, RUN_FLYABLE)


@scalar_kernel
def note(found, high, code):
    """Take down the next stretch of a column, going down from the ceiling; high is its upper end.

    found: Findings, NOTHING_FOUND to begin with.
    """
    flyable, unknown, safe, first_code, intervals, run = found
    if code == FLYABLE:
        return Findings(True, unknown, safe, first_code, intervals, RUN_FLYABLE)
    if first_code == FLYABLE:
        safe, first_code = high, code
    if code == UNKNOWN:
        return Findings(flyable, True, safe, first_code, intervals, max(run, RUN_UNKNOWN))
    return Findings(flyable, unknown, safe, first_code, intervals + (1 if run < RUN_CLOSED else 0), RUN_CLOSED)


@scalar_kernel
def conclude(found, ground, ceiling):
    """The Column whose stretches were all taken down."""
    flyable, unknown, safe, first_code, intervals, _ = found
    if first_code == FLYABLE:
        return Column(ground, ground, EVERYWHERE, intervals)
    if safe >= ceiling:
        if first_code == UNKNOWN:
            return Column(math.nan, math.inf, UNKNOWN, intervals)
        return Column(math.nan, math.inf, CLOSED_AT_CEILING if flyable or unknown else NOWHERE, intervals)
    if first_code == UNKNOWN:
        return Column(math.nan, safe, UNKNOWN, intervals)
    return Column(safe, safe, ABOVE, intervals)


# one row of the table each; the set in sight changes at the altitudes in those before AWAY
SURE, MAYBE, GAP_FROM, GAP_TO, TOP, AWAY, LEVEL, EAST, NORTH = 0, 1, 2, 3, 4, 5, 6, 7, 8
COLUMN_ROWS = 9


class Question(NamedTuple):
    """Where a dilution (measure) of ranges of a kind from sources is below limit, with so many anchors needed.

    resolution_m: how thin a stretch of air is asked about.
    """

    sources: Any
    kind: int
    measure: int
    limit: float
    needed: int
    resolution_m: float


@scalar_kernel
def fill_column(table, surfaces, row, col, position, antennas):
    """Fill the table of the column over post (row, col) at position (east, north); returns whether all is known.

    surfaces, antennas: Surfaces and Antennas (dilution.kernels.visible_sets).
    """
    altitude_m, hidden_below_m, _ = surfaces
    anchors, distant, limits, limited, drop_per_m2 = antennas
    known = True
    for a in range(anchors.shape[0]):
        sure = float(altitude_m[a, row, col])
        table[MAYBE, a] = sure
        if math.isnan(sure):
            known = False
            sure = math.inf
            maybe = float(hidden_below_m[a, row, col])
            table[MAYBE, a] = -math.inf if math.isnan(maybe) else maybe
        table[SURE, a] = sure
        table[GAP_FROM, a], table[GAP_TO, a], table[TOP, a] = math.inf, math.inf, math.inf
        table[AWAY, a], table[LEVEL, a], table[EAST, a], table[NORTH, a] = 0.0, math.inf, 0.0, 0.0
        if not distant[a]:
            east, north = anchors[a, 0] - position[0], anchors[a, 1] - position[1]
            away = math.sqrt(east * east + north * north)
            table[AWAY, a], table[LEVEL, a], table[EAST, a], table[NORTH, a] = away, anchors[a, 2], east, north
            if limited[a]:
                level = anchors[a, 2] + drop_per_m2 * away * away
                too_near, top = upper_bounds(away, limits[a])
                table[TOP, a] = level + top
                if too_near > 0.0:
                    table[GAP_FROM, a], table[GAP_TO, a] = level - too_near, level + too_near
    return known


@scalar_kernel
def set_between(table, low, high, start, throughout, words):
    """Fill words with the anchors in sight from low to high: throughout, or at some altitude between.

    start: SURE for those in sight for certain, MAYBE for those that are or may be.
    """
    for word in range(words.shape[0]):
        words[word] = np.uint64(0)
    for a in range(table.shape[1]):
        if throughout:
            clear_of_gap = table[GAP_TO, a] <= low or table[GAP_FROM, a] >= high
            seen = table[start, a] <= low and table[TOP, a] >= high and clear_of_gap
        else:
            in_gap = table[GAP_FROM, a] <= low and table[GAP_TO, a] >= high
            seen = table[start, a] < high and table[TOP, a] > low and not in_gap
        if seen:
            words[a >> 6] |= np.uint64(1) << np.uint64(a & 63)


@scalar_kernel
def same_set(words, other):
    """Whether two sets are the same."""
    different = np.uint64(0)
    for word in range(words.shape[0]):
        different |= words[word] ^ other[word]
    return different == 0


@scalar_kernel
def count_of(words):
    """How many anchors are in a set."""
    count = 0
    for word in range(words.shape[0]):
        rest = words[word]
        while rest != 0:
            rest &= rest - np.uint64(1)
            count += 1
    return count


@scalar_kernel
def next_split(table, low, high):
    """Where to cut a stretch of air: at the change of the visible set nearest its middle, else in its middle."""
    middle = 0.5 * (low + high)
    above, below = high, low
    for edge in range(AWAY):
        for a in range(table.shape[1]):
            altitude = table[edge, a]
            above = altitude if middle <= altitude < above else above
            below = altitude if below < altitude < middle else below
    if above == high and below == low:
        return middle
    return below if above == high or (below > low and middle - below < above - middle) else above


@scalar_kernel
def steepness(table, words, low, high):
    """(b, c): bounds from low to high on how fast the rows of the geometry matrix turn with altitude, 1/m and 1/m².

    b bounds the norm of the matrix' first derivative, c that of its second. Of a unit vector to an anchor at distance r
    and horizontal distance h they are h/r² and at most 2·h/r³.
    """
    first, second = 0.0, 0.0
    for a in range(table.shape[1]):
        if (words[a >> 6] >> np.uint64(a & 63)) & np.uint64(1) == 0:
            continue
        away, level = table[AWAY, a], table[LEVEL, a]
        beside = max(low - level, level - high, 0.0)
        square = away * away + beside * beside
        if square == 0.0:
            return math.inf, math.inf
        rate = away / square
        first += rate * rate
        second += 4.0 * rate * rate / square
    return math.sqrt(first), math.sqrt(second)
