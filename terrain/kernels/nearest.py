"""The nearest place of the triangulated surface: exact, through a pyramid of the lowest and highest ground.

A node of level 0 of the pyramid is a square of four posts; one of level L covers 2^L × 2^L of them. Places are metres
east, north and up of the post (0, 0), so north is negative inside the grid; cells are (east, north).
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel

from .surface import settled, surface_height
from .triangle import nearest_on_triangle

__all__ = ["Pyramid", "build_pyramid", "nearest_places"]

# four children of every level but the last, of at most 32 levels
STACK = 128

FIRST, ROWS, COLS = 0, 1, 2  # columns of levels
LEVEL, ROW, COL = 0, 1, 2  # of nodes that wait to be looked into


class Pyramid(NamedTuple):
    """Per node of every level, finest first, (nodes,): lowest and highest known post, any unknown triangle.

    levels: (n, 3) the FIRST node, ROWS and COLS of each.
    """

    low_m: Any
    high_m: Any
    holes: Any
    levels: Any


@scalar_kernel
def build_pyramid(heights_m, levels, low_m, high_m, holes):
    """Fill low_m, high_m and holes of every node; an unknown node is higher than nothing and lower than nothing."""
    for r in range(levels[0, ROWS]):
        for c in range(levels[0, COLS]):
            node = r * levels[0, COLS] + c
            low_m[node], high_m[node], holes[node] = math.inf, -math.inf, False
            for i in range(2):
                for j in range(2):
                    height_m = heights_m[r + i, c + j]
                    if math.isnan(height_m):
                        holes[node] = True
                    else:
                        low_m[node] = min(low_m[node], height_m)
                        high_m[node] = max(high_m[node], height_m)
    for level in range(1, levels.shape[0]):
        under = level - 1
        below, rows_below, cols_below = levels[under, FIRST], levels[under, ROWS], levels[under, COLS]
        for r in range(levels[level, ROWS]):
            for c in range(levels[level, COLS]):
                node = levels[level, FIRST] + r * levels[level, COLS] + c
                low_m[node], high_m[node], holes[node] = math.inf, -math.inf, False
                for i in range(2 * r, min(2 * r + 2, rows_below)):
                    for j in range(2 * c, min(2 * c + 2, cols_below)):
                        child = below + i * cols_below + j
                        low_m[node] = min(low_m[node], low_m[child])
                        high_m[node] = max(high_m[node], high_m[child])
                        holes[node] = holes[node] or holes[child]


@scalar_kernel
def _node_distance2(point, cells, pyramid, level, r, c, unknown):
    """Squared distance to the box around a node that nothing in it can be nearer than; inf where nothing is in it."""
    low_m, high_m, holes, levels = pyramid
    node = levels[level, FIRST] + r * levels[level, COLS] + c
    size = 1 << level
    cell_east_m, cell_north_m = cells
    west_m, east_m = c * size * cell_east_m, min((c + 1) * size, levels[0, COLS]) * cell_east_m
    north_m, south_m = -r * size * cell_north_m, -min((r + 1) * size, levels[0, ROWS]) * cell_north_m
    across_m = max(west_m - point[0], point[0] - east_m, 0.0)
    along_m = max(south_m - point[1], point[1] - north_m, 0.0)
    over_m = 0.0
    if unknown:
        if not holes[node]:
            return math.inf
    else:
        if not low_m[node] <= high_m[node]:
            return math.inf
        over_m = max(low_m[node] - point[2], point[2] - high_m[node], 0.0)
    return across_m * across_m + along_m * along_m + over_m * over_m


@scalar_kernel
def _in_square(point, heights_m, cells, r, c, unknown):
    """(place, squared distance) of a square's nearer triangle: of a known one, or seen from above an unknown one."""
    cell_east_m, cell_north_m = cells
    best, least2 = (math.nan, math.nan, math.nan), math.inf
    for half in range(2):
        i, j = (r + 1, c) if half == 0 else (r, c + 1)
        first, second, third = float(heights_m[r, c]), float(heights_m[i, j]), float(heights_m[r + 1, c + 1])
        if math.isnan(first + second + third) != unknown:
            continue
        if unknown:
            first, second, third = point[2], point[2], point[2]
        place, distance2 = nearest_on_triangle(
            point,
            (c * cell_east_m, -r * cell_north_m, first),
            (j * cell_east_m, -i * cell_north_m, second),
            ((c + 1) * cell_east_m, -(r + 1) * cell_north_m, third),
        )
        if distance2 < least2:
            best, least2 = place, distance2
    return best, least2


@scalar_kernel
def _search(point, heights_m, cells, pyramid, unknown):
    """(place, squared distance) of the nearest known triangle, or seen from above of the nearest unknown one."""
    levels = pyramid.levels
    cell_east_m, cell_north_m = cells
    rows, cols = levels[0, ROWS], levels[0, COLS]
    below_r = min(max(int(-point[1] / cell_north_m), 0), rows - 1)
    below_c = min(max(int(point[0] / cell_east_m), 0), cols - 1)
    best, least2 = _in_square(point, heights_m, cells, below_r, below_c, unknown)
    nodes, bounds = np.empty((STACK, 3), np.int64), np.empty(STACK)
    nodes[0, LEVEL], nodes[0, ROW], nodes[0, COL] = levels.shape[0] - 1, 0, 0
    bounds[0] = 0.0
    waiting = 1
    while waiting > 0:
        waiting -= 1
        if bounds[waiting] >= least2:
            continue
        level, r, c = nodes[waiting, LEVEL], nodes[waiting, ROW], nodes[waiting, COL]
        if level == 0:
            place, distance2 = _in_square(point, heights_m, cells, r, c, unknown)
            if distance2 < least2:
                best, least2 = place, distance2
            continue
        first = waiting
        for i in range(2 * r, min(2 * r + 2, levels[level - 1, ROWS])):
            for j in range(2 * c, min(2 * c + 2, levels[level - 1, COLS])):
                bound = _node_distance2(point, cells, pyramid, level - 1, i, j, unknown)
                if bound >= least2:
                    continue
                # kept in order, the nearest on top, so that it is looked into first
                slot = waiting
                while slot > first and bounds[slot - 1] < bound:
                    bounds[slot] = bounds[slot - 1]
                    nodes[slot] = nodes[slot - 1]
                    slot -= 1
                bounds[slot] = bound
                nodes[slot, LEVEL], nodes[slot, ROW], nodes[slot, COL] = level - 1, i, j
                waiting += 1
    return best, least2


@parallel_kernel
def nearest_places(points_m, heights_m, cells, pyramid, nearest_m, distance_m, unknown_m):
    """Fill nearest_m (n, 3), the signed distance_m (n,) and unknown_m (n,), the way to unknown ground seen from above.

    points_m: (n, 3) from the post (0, 0). distance_m: below the surface negative; outside the grid and over unknown
    ground NaN, as is nearest_m. unknown_m: inf where all ground is known, NaN outside the grid.
    """
    root = pyramid.levels[pyramid.levels.shape[0] - 1, FIRST]
    has_holes = pyramid.holes[root]
    cell_east_m, cell_north_m = cells
    for p in prange(points_m.shape[0]):
        point = (points_m[p, 0], points_m[p, 1], points_m[p, 2])
        row, col = settled(-point[1] / cell_north_m), settled(point[0] / cell_east_m)
        nearest_m[p, :] = math.nan
        distance_m[p], unknown_m[p] = math.nan, math.nan
        inside = row >= 0.0 and row <= heights_m.shape[0] - 1 and col >= 0.0 and col <= heights_m.shape[1] - 1
        if not inside:
            continue
        unknown_m[p] = math.inf
        if has_holes:
            _, unknown2 = _search(point, heights_m, cells, pyramid, True)
            unknown_m[p] = math.sqrt(unknown2)
        ground_m = surface_height(heights_m, row, col)
        if math.isnan(ground_m):
            continue
        place, distance2 = _search(point, heights_m, cells, pyramid, False)
        nearest_m[p, 0], nearest_m[p, 1], nearest_m[p, 2] = place
        distance_m[p] = math.sqrt(distance2) if point[2] >= ground_m else -math.sqrt(distance2)
