"""Making paths cheaper without leaving what may be driven or flown; every segment is checked as it is costed.

A place is (row, col, altitude): fractional posts and metres. air is a ``planning.paths.flights.Air``.
"""

import math

import numpy as np

from compiled.options import scalar_kernel

from .path_segments import cost_within

__all__ = ["flight_cost", "pull", "pull_flight", "relax", "way_cost"]

EDGE = 1e-9


@scalar_kernel
def way_cost(field, places):
    """Cost of a path (n, 2) of fractional posts; +inf where it may not be driven."""
    total = 0.0
    for i in range(places.shape[0] - 1):
        total += cost_within(field, places[i, 0], places[i, 1], places[i + 1, 0], places[i + 1, 1], math.inf)
    return total


@scalar_kernel
def pull(field, places, window):
    """The cheapest path through some of the places (n, 2), first and last among them.

    window: straight pieces are at most so many cells long.
    """
    n = places.shape[0]
    cells, least = field.cells, field.rates.least_per_m
    known = np.full(n, math.inf)
    known[0] = 0.0
    before = np.zeros(n, np.int64)
    for j in range(1, n):
        for i in range(j - 1, -1, -1):
            rows, cols = places[j, 0] - places[i, 0], places[j, 1] - places[i, 1]
            if i < j - 1 and rows * rows + cols * cols > window * window:
                break
            down, across = rows * cells.north_m, cols * cells.east_m
            # of ways that cost the same, the one of fewer pieces
            room = (known[j] - known[i]) * (1.0 + 1e-9)
            if least * math.sqrt(down * down + across * across) > room:
                continue
            cost = cost_within(field, places[i, 0], places[i, 1], places[j, 0], places[j, 1], room)
            if cost <= room:
                known[j], before[j] = known[i] + cost, i
    kept = np.zeros(n, np.bool_)
    kept[0] = True
    j = n - 1
    while j > 0:
        kept[j] = True
        j = before[j]
    return places[kept]


@scalar_kernel
def relax(field, places, reach, rounds):
    """Move each inner place (n, 2) about, by ``reach`` cells and less, while that makes the path cheaper."""
    places = places.copy()
    n = places.shape[0]
    legs = np.zeros(n)
    for i in range(n - 1):
        legs[i] = cost_within(field, places[i, 0], places[i, 1], places[i + 1, 0], places[i + 1, 1], math.inf)
    diagonal = math.sqrt(0.5)
    # where neither a place nor one beside it has moved since it was looked at, nothing is found again
    open_ = np.ones(n, np.bool_)
    for _ in range(rounds):
        moved = False
        for i in range(1, n - 1):
            if not open_[i]:
                continue
            open_[i] = False
            for way in range(8):
                down = (1.0, -1.0, 0.0, 0.0, diagonal, diagonal, -diagonal, -diagonal)[way] * reach
                across = (0.0, 0.0, 1.0, -1.0, diagonal, -diagonal, diagonal, -diagonal)[way] * reach
                row, col = places[i, 0] + down, places[i, 1] + across
                room = (legs[i - 1] + legs[i]) * (1.0 - 1e-9)
                into = cost_within(field, places[i - 1, 0], places[i - 1, 1], row, col, room)
                if into >= room:
                    continue
                out = cost_within(field, row, col, places[i + 1, 0], places[i + 1, 1], room - into)
                if into + out < room:
                    places[i, 0], places[i, 1] = row, col
                    legs[i - 1], legs[i] = into, out
                    open_[i - 1 : i + 2] = True
                    moved = True
                    break
        if not moved:
            reach *= 0.5
            open_[:] = True
            if reach < 0.02:
                break
    return places


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
