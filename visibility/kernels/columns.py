"""The column of air over a post: between which altitudes each anchor is in sight there.

A column is a table (anchors, 7). Anchor a is in sight at altitude z where z ≥ table[a, SURE], z ≤ table[a, TOP] and z
is not between GAP_FROM and GAP_TO (too near the anchor). From MAYBE to SURE it is not known. AWAY is the horizontal
distance to the anchor and LEVEL its altitude; a distant one, whose direction is the same everywhere, has AWAY 0 and
LEVEL +inf. Visible sets are bits in uint64 words, bit a % 64 of word a // 64 for anchor a.
"""

import math

import numpy as np

from terrain.kernel_options import scalar_kernel

from .reach import upper_bounds

__all__ = ["COLUMN_WIDTH", "count_of", "fill_column", "next_split", "same_set", "set_between", "steepness"]

SURE, MAYBE, GAP_FROM, GAP_TO, TOP, AWAY, LEVEL = 0, 1, 2, 3, 4, 5, 6
COLUMN_WIDTH = 7


@scalar_kernel
def fill_column(table, surfaces, row, col, position, reach):
    """Fill the table of the column over post (row, col) at position (east, north); returns whether all is known.

    surfaces: (altitude_m, hidden_below_m, ground_m), the first two (anchors, rows, cols).
    reach: (anchors (k, 3) or directions, distant (k,), limits (k, 6), limited (k,), drop_per_m2).
    """
    altitude_m, hidden_below_m, _ = surfaces
    anchors, distant, limits, limited, drop_per_m2 = reach
    known = True
    for a in range(anchors.shape[0]):
        sure = float(altitude_m[a, row, col])
        table[a, MAYBE] = sure
        if math.isnan(sure):
            known = False
            sure = math.inf
            maybe = float(hidden_below_m[a, row, col])
            table[a, MAYBE] = -math.inf if math.isnan(maybe) else maybe
        table[a, SURE] = sure
        table[a, GAP_FROM], table[a, GAP_TO], table[a, TOP] = math.inf, math.inf, math.inf
        table[a, AWAY], table[a, LEVEL] = 0.0, math.inf
        if not distant[a]:
            away = math.hypot(anchors[a, 0] - position[0], anchors[a, 1] - position[1])
            table[a, AWAY], table[a, LEVEL] = away, anchors[a, 2]
            if limited[a]:
                level = anchors[a, 2] + drop_per_m2 * away * away
                too_near, top = upper_bounds(away, limits[a])
                table[a, TOP] = level + top
                if too_near > 0.0:
                    table[a, GAP_FROM], table[a, GAP_TO] = level - too_near, level + too_near
    return known


@scalar_kernel
def set_between(table, low, high, start, throughout, words):
    """Fill words with the anchors in sight from low to high: throughout, or at some altitude between.

    start: SURE for those in sight for certain, MAYBE for those that are or may be.
    """
    for word in range(words.shape[0]):
        words[word] = np.uint64(0)
    for a in range(table.shape[0]):
        if throughout:
            clear_of_gap = table[a, GAP_TO] <= low or table[a, GAP_FROM] >= high
            seen = table[a, start] <= low and table[a, TOP] >= high and clear_of_gap
        else:
            in_gap = table[a, GAP_FROM] <= low and table[a, GAP_TO] >= high
            seen = table[a, start] < high and table[a, TOP] > low and not in_gap
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
    best, best_off = middle, math.inf
    for a in range(table.shape[0]):
        for edge in range(AWAY):
            altitude = table[a, edge]
            off = abs(altitude - middle)
            if low < altitude < high and off < best_off:
                best, best_off = altitude, off
    return best


@scalar_kernel
def steepness(table, words, low, high):
    """(b, c): bounds from low to high on how fast the rows of the geometry matrix turn with altitude, 1/m and 1/m².

    b bounds the norm of the matrix' first derivative, c that of its second. Of a unit vector to an anchor at distance r
    and horizontal distance h they are h/r² and at most 2·h/r³.
    """
    first, second = 0.0, 0.0
    for a in range(table.shape[0]):
        if (words[a >> 6] >> np.uint64(a & 63)) & np.uint64(1) == 0:
            continue
        away, level = table[a, AWAY], table[a, LEVEL]
        beside = max(low - level, level - high, 0.0)
        square = away * away + beside * beside
        if square == 0.0:
            return math.inf, math.inf
        rate = away / square
        first += rate * rate
        second += 4.0 * rate * rate / square
    return math.sqrt(first), math.sqrt(second)
