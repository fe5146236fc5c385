"""What each square of four posts is worth to a rover: slope, step, anchors in sight, dilution; careful bounds of each.

A square counts as the worst of what is in it: the steeper of its triangles, the anchors that all four posts see, the
largest dilution of that set at its posts.
"""

import math

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel
from visibility.dilution.kernels.dop import dop_of_set

from .path_segments import square_gradients

__all__ = ["clearances", "fill_counts", "fill_positioning", "fill_slopes", "fill_steps"]


@parallel_kernel
def fill_slopes(heights_m, cells, slope):
    """Fill slope (rows - 1, cols - 1) with the tangent of the steeper triangle; NaN where a post is unknown."""
    for row in prange(slope.shape[0]):
        for col in range(slope.shape[1]):
            west_e, west_n, east_e, east_n = square_gradients(heights_m, cells, row, col)
            west, east = west_e * west_e + west_n * west_n, east_e * east_e + east_n * east_n
            slope[row, col] = math.sqrt(west) if west > east or math.isnan(west) else math.sqrt(east)


@scalar_kernel
def _near(rows_apart, cols_apart, cells, radius_m):
    """Whether some point of one square is less than a radius from some point of another."""
    east_m, north_m = max(abs(cols_apart) - 1, 0) * cells.east_m, max(abs(rows_apart) - 1, 0) * cells.north_m
    return east_m * east_m + north_m * north_m < radius_m * radius_m


@parallel_kernel
def fill_steps(heights_m, cells, radius_m, step_m):
    """Fill step_m with a bound of how far ground within a radius departs from the plane of the triangle in its middle.

    Two bounds hold, and the lesser counts: the radius times how much gradients differ; what posts around depart by.
    NaN where a post within the radius is unknown.
    """
    rows, cols = step_m.shape
    down, across = math.ceil(radius_m / cells.north_m), math.ceil(radius_m / cells.east_m)
    for row in prange(rows):
        for col in range(cols):
            mine = square_gradients(heights_m, cells, row, col)
            bend, apart_m = 0.0, 0.0
            for r in range(max(row - down, 0), min(row + down + 1, rows)):
                for c in range(max(col - across, 0), min(col + across + 1, cols)):
                    if not ((r == row and c == col) or _near(r - row, c - col, cells, radius_m)):
                        continue
                    other = square_gradients(heights_m, cells, r, c)
                    for a in range(0, 4, 2):
                        for b in range(0, 4, 2):
                            east, north = other[b] - mine[a], other[b + 1] - mine[a + 1]
                            size = math.sqrt(east * east + north * north)
                            bend = size if size > bend or math.isnan(size) else bend
                        # the plane of one of the square's triangles, at a post of the other square
                        for r1 in range(r, r + 2):
                            for c1 in range(c, c + 2):
                                plane_m = float(heights_m[row, col]) + mine[a] * (c1 - col) * cells.east_m
                                plane_m -= mine[a + 1] * (r1 - row) * cells.north_m
                                apart_m = max(apart_m, abs(float(heights_m[r1, c1]) - plane_m))
            step_m[row, col] = min(radius_m * bend, apart_m) if not math.isnan(bend) else np.nan


@scalar_kernel
def _all_see(seen, a, row, col):
    """Whether all four posts of a square see an anchor."""
    return (
        seen[a, row, col] == 1
        and seen[a, row, col + 1] == 1
        and seen[a, row + 1, col] == 1
        and seen[a, row + 1, col + 1] == 1
    )


@parallel_kernel
def fill_counts(seen, count):
    """Fill count (uint16) of each square with the anchors that all four posts see; seen as for fill_positioning."""
    for row in prange(count.shape[0]):
        count[row, :] = 0
        for a in range(seen.shape[0]):
            for col in range(count.shape[1]):
                if _all_see(seen, a, row, col):
                    count[row, col] += 1


@parallel_kernel
def fill_positioning(heights_m, cells, seen, antennas, sources, wanted, count, dop):
    """Fill count (uint16) and dop (float32) of each square from the anchors that all four posts see.

    seen: (anchors, rows, cols) uint8, 1 = in sight. antennas, wanted: as ``planning.paths.sight_maps`` names their
    fields.
    """
    anchors = seen.shape[0]
    on_ground = wanted.on_ground
    for row in prange(count.shape[0]):
        words = np.zeros((anchors + 63) // 64, np.uint64)
        for col in range(count.shape[1]):
            words[:] = 0
            number = 0
            for a in range(anchors):
                if _all_see(seen, a, row, col):
                    words[a >> 6] |= np.uint64(1) << np.uint64(a & 63)
                    number += 1
            count[row, col] = number
            worst = 0.0
            gradients = square_gradients(heights_m, cells, row, col)
            for corner in range(4):
                r, c = row + corner // 2, col + corner % 2
                east_m = antennas.origin_east_m + c * cells.east_m
                north_m = antennas.origin_north_m - r * cells.north_m
                point = (east_m, north_m, float(heights_m[r, c]) + antennas.above_ground_m)
                for triangle in range(2 if on_ground else 1):
                    normal = (0.0, 0.0, 0.0)
                    if on_ground:
                        east, north = gradients[2 * triangle], gradients[2 * triangle + 1]
                        size = math.sqrt(1.0 + east * east + north * north)
                        normal = (-east / size, -north / size, 1.0 / size)
                    found = dop_of_set(point, sources, words, wanted.kind, normal)
                    worst = max(worst, (found.gdop, found.pdop, found.hdop, found.vdop, found.tdop)[wanted.measure])
            dop[row, col] = worst


@scalar_kernel
def _apart(row, col, square_row, square_col, cells):
    """Metres from a place to a square; 0 within it."""
    down = max(square_row - row, row - (square_row + 1), 0.0) * cells.north_m
    across = max(square_col - col, col - (square_col + 1), 0.0) * cells.east_m
    return math.sqrt(down * down + across * across)


@parallel_kernel
def clearances(obstacles, cells, places, out):
    """Fill out (n,) with the metres from places (n, 2) to the nearest square marked 1, or to the border of the grid."""
    rows, cols = obstacles.shape
    for i in prange(places.shape[0]):
        row, col = places[i, 0], places[i, 1]
        best = min(min(row, rows - row) * cells.north_m, min(col, cols - col) * cells.east_m)
        middle_row, middle_col = min(max(int(row), 0), rows - 1), min(max(int(col), 0), cols - 1)
        ring = 0
        # every square of a ring is at least so many whole cells away
        while ring == 0 or (ring - 1) * min(cells.east_m, cells.north_m) < best:
            top, bottom, left, right = middle_row - ring, middle_row + ring, middle_col - ring, middle_col + ring
            for r in range(max(top, 0), min(bottom + 1, rows)):
                stride = 1 if r in (top, bottom) else max(2 * ring, 1)
                for c in range(left, right + 1, stride):
                    if 0 <= c < cols and obstacles[r, c] == 1:
                        best = min(best, _apart(row, col, r, c, cells))
            ring += 1
        out[i] = max(best, 0.0)
