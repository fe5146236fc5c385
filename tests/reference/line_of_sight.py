"""Slow obvious oracle for line of sight: cut the line by every triangle, in exact rational arithmetic.

Imports nothing of ours. Post (row, col) stands at east = col·cell_east, north = -row·cell_north. Posts, and the far end
of the line, are first lowered by drop·d², d from the first point; then all is straight.
"""

import math
from fractions import Fraction

import numpy as np


def _triangles(rows, cols):
    for r in range(rows - 1):
        for c in range(cols - 1):
            yield (r, c), (r + 1, c), (r + 1, c + 1)
            yield (r, c), (r, c + 1), (r + 1, c + 1)


def _weights(corners, east, north):
    """Barycentric weights of a point in a triangle seen in plan."""
    (ax, ay), (bx, by), (cx, cy) = corners
    area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    b = ((east - ax) * (cy - ay) - (cx - ax) * (north - ay)) / area
    c = ((bx - ax) * (north - ay) - (east - ax) * (by - ay)) / area
    return 1 - b - c, b, c


def clearance_and_unknown(heights_m, cells_m, start, end, drop_per_m2=0.0):
    """(least clearance as a Fraction or None, passes over unknown ground); cells_m = (east, north)."""
    heights_m = np.asarray(heights_m)
    rows, cols = heights_m.shape
    cell_east, cell_north = (Fraction(float(cell)) for cell in cells_m)
    drop = Fraction(float(drop_per_m2))
    x0, y0, z0 = (Fraction(float(value)) for value in start)
    x1, y1, z1 = (Fraction(float(value)) for value in end)
    z1 -= drop * ((x1 - x0) ** 2 + (y1 - y0) ** 2)

    def place(post):
        return post[1] * cell_east, -post[0] * cell_north

    def lowered(post):
        east, north = place(post)
        return Fraction(float(heights_m[post])) - drop * ((east - x0) ** 2 + (north - y0) ** 2)

    least, over_unknown = None, False
    for posts in _triangles(rows, cols):
        corners = [place(post) for post in posts]
        first, last = _weights(corners, x0, y0), _weights(corners, x1, y1)
        near, far = Fraction(0), Fraction(1)
        for at_start, at_end in zip(first, last, strict=True):
            # the part of the line on the inner side of one edge: weight at_start + t (at_end - at_start) >= 0
            if at_start == at_end:
                if at_start < 0:
                    near, far = Fraction(1), Fraction(0)
            elif at_end > at_start:
                near = max(near, -at_start / (at_end - at_start))
            else:
                far = min(far, at_start / (at_start - at_end))
        if near > far:
            continue
        ends = [[a + t * (b - a) for a, b in zip(first, last, strict=True)] for t in (near, far)]
        unknown = [math.isnan(heights_m[post]) for post in posts]
        if any(unknown[i] and (ends[0][i] != 0 or ends[1][i] != 0) for i in range(3)):
            over_unknown = True
        for t, weights in zip((near, far), ends, strict=True):
            if any(unknown[i] and weights[i] != 0 for i in range(3)):
                continue
            ground = sum(weights[i] * lowered(posts[i]) for i in range(3) if weights[i] != 0)
            clearance = z0 + t * (z1 - z0) - ground
            least = clearance if least is None else min(least, clearance)
    return least, over_unknown


def clearance_of_all_edges(heights_m, cells_m, start, end, drop_per_m2=0.0):
    """Least clearance over the line's crossings with every edge of known ground, in float64; ends left out."""
    heights_m = np.asarray(heights_m, float)
    rows, cols = heights_m.shape
    east, north = np.arange(cols) * cells_m[0], -np.arange(rows) * cells_m[1]
    east, north = np.broadcast_arrays(east[None, :], north[:, None])
    (x0, y0, z0), (x1, y1, z1) = start, end
    up = heights_m - drop_per_m2 * ((east - x0) ** 2 + (north - y0) ** 2)
    z1 = z1 - drop_per_m2 * ((x1 - x0) ** 2 + (y1 - y0) ** 2)
    posts = np.stack([east, north, up], axis=-1)
    least = np.inf
    for a, b in ((posts[:, :-1], posts[:, 1:]), (posts[:-1], posts[1:]), (posts[:-1, :-1], posts[1:, 1:])):
        a, b = a.reshape(-1, 3), b.reshape(-1, 3)
        side_a = (x1 - x0) * (a[:, 1] - y0) - (y1 - y0) * (a[:, 0] - x0)
        side_b = (x1 - x0) * (b[:, 1] - y0) - (y1 - y0) * (b[:, 0] - x0)
        crossed = (side_a * side_b <= 0) & (side_a != side_b)
        a, b, share = a[crossed], b[crossed], (side_a / np.where(crossed, side_a - side_b, 1.0))[crossed]
        at = a + share[:, None] * (b - a)
        t = ((at[:, 0] - x0) * (x1 - x0) + (at[:, 1] - y0) * (y1 - y0)) / ((x1 - x0) ** 2 + (y1 - y0) ** 2)
        within = (t >= 0) & (t <= 1)
        if within.any():
            least = min(least, (z0 + t * (z1 - z0) - at[:, 2])[within].min())
    return least


def shortest_way_over(distance_m, ground_m, start_m, end_m):
    """Length of the shortest polyline from height start_m to end_m that stays on or above a profile of corners."""
    corners = [(distance_m[0], start_m), *zip(distance_m[1:-1], ground_m[1:-1], strict=True), (distance_m[-1], end_m)]
    shortest = [0.0] + [math.inf] * (len(corners) - 1)
    for j in range(1, len(corners)):
        for i in range(j):
            (xi, zi), (xj, zj) = corners[i], corners[j]
            between = corners[i + 1 : j]
            if all(zi + (x - xi) / (xj - xi) * (zj - zi) >= z - 1e-9 for x, z in between):
                shortest[j] = min(shortest[j], shortest[i] + math.hypot(xj - xi, zj - zi))
    return shortest[-1]
