"""Making a path over a field cheaper without leaving what may be driven; every segment is checked as it is costed."""

import math

import numpy as np

from compiled.options import scalar_kernel

from .path_segments import cost_within

__all__ = ["pull", "relax", "way_cost"]


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
    for _ in range(rounds):
        moved = False
        for i in range(1, n - 1):
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
                    moved = True
                    break
        if not moved:
            reach *= 0.5
            if reach < 0.02:
                break
    return places
