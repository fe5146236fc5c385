"""Straight flights over squares of air: each square may be flown from a floor up to a ceiling.

A place is (row, col, altitude): fractional posts and metres. air is a ``planning.paths.flights.Air``.
"""

import math

import numpy as np

from compiled.options import scalar_kernel

__all__ = ["flight_cost", "pull_flight"]

EDGE = 1e-9


@scalar_kernel
def _room(floor_m, ceiling_m, row, col):
    """(floor, ceiling) of the squares that touch a place: the highest floor and the lowest ceiling."""
    rows, cols = floor_m.shape
    if not (-EDGE <= row <= rows + EDGE and -EDGE <= col <= cols + EDGE):
        return math.inf, -math.inf
    low, high = -math.inf, math.inf
    for r in range(max(math.ceil(row - EDGE) - 1, 0), min(math.floor(row + EDGE), rows - 1) + 1):
        for c in range(max(math.ceil(col - EDGE) - 1, 0), min(math.floor(col + EDGE), cols - 1) + 1):
            low, high = max(low, floor_m[r, c]), min(high, ceiling_m[r, c])
    return low, high


@scalar_kernel
def _next_line(at, step):
    """The share at which the next whole number is met beyond a coordinate that moves by step."""
    if step == 0.0:
        return math.inf
    line = math.floor(at + EDGE) + 1.0 if step > 0.0 else math.ceil(at - EDGE) - 1.0
    return (line - at) / step


@scalar_kernel
def flight_cost(air, begin, end):
    """Metres flown + climb_weight · metres climbed of a straight flight; +inf where it leaves what may be flown."""
    (row0, col0, up0_m), (row1, col1, up1_m) = begin, end
    down, across, rise = row1 - row0, col1 - col0, up1_m - up0_m
    share = 0.0
    while True:
        row, col = row0 + share * down, col0 + share * across
        after = min(share + min(_next_line(row, down), _next_line(col, across)), 1.0)
        middle = 0.5 * (share + after)
        low, high = _room(air.floor_m, air.ceiling_m, row0 + middle * down, col0 + middle * across)
        lowest = min(up0_m + share * rise, up0_m + after * rise)
        if lowest < low - EDGE or max(up0_m + share * rise, up0_m + after * rise) > high + EDGE:
            return math.inf
        # a post or line between squares is passed at one altitude, which all squares around it must allow
        low, high = _room(air.floor_m, air.ceiling_m, row0 + after * down, col0 + after * across)
        if not low - EDGE <= up0_m + after * rise <= high + EDGE:
            return math.inf
        share = after
        if share >= 1.0:
            break
    east_m, north_m = across * air.cells.east_m, down * air.cells.north_m
    return math.sqrt(east_m * east_m + north_m * north_m + rise * rise) + air.climb_weight * max(rise, 0.0)


@scalar_kernel
def pull_flight(air, places):
    """The cheapest flight through some of the places (n, 3), first and last among them."""
    n = places.shape[0]
    known, before = np.full(n, math.inf), np.zeros(n, np.int64)
    known[0] = 0.0
    for j in range(1, n):
        for i in range(j):
            if known[i] == math.inf:
                continue
            begin, end = (places[i, 0], places[i, 1], places[i, 2]), (places[j, 0], places[j, 1], places[j, 2])
            cost = known[i] + flight_cost(air, begin, end)
            if cost < known[j]:
                known[j], before[j] = cost, i
    kept = np.zeros(n, np.bool_)
    kept[0] = True
    j = n - 1
    while j > 0:
        kept[j] = True
        j = before[j]
    return known[n - 1], places[kept]
