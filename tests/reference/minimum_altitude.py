"""Slow obvious oracle for the minimum visible altitude: every edge of the triangulation against every sight line.

Imports nothing of ours. For one post it intersects, in plan, the segment from the eye to the post with every edge of
every triangle, and takes the steepest slope from the eye to a crossing.
"""

import numpy as np


def all_edges(rows, cols):
    """(n, 4) row, col, row, col of every edge of the triangulation with diagonals (r, c)-(r+1, c+1)."""
    edges = []
    for r in range(rows):
        for c in range(cols):
            if c + 1 < cols:
                edges.append((r, c, r, c + 1))
            if r + 1 < rows:
                edges.append((r, c, r + 1, c))
            if r + 1 < rows and c + 1 < cols:
                edges.append((r, c, r + 1, c + 1))
    return np.array(edges, dtype=float).reshape(-1, 4)


def over_unknown(heights_m, row, col):
    """Whether a place lies in a triangle with an unknown corner (on its edges, only the corners there count)."""
    rows, cols = heights_m.shape
    for r in range(rows - 1):
        for c in range(cols - 1):
            down, across = row - r, col - c
            if 0 <= down <= 1 and 0 <= across <= 1:
                side = (r + 1, c) if down >= across else (r, c + 1)
                weights = {(r, c): 1 - max(down, across), side: abs(down - across), (r + 1, c + 1): min(down, across)}
                return any(np.isnan(heights_m[post]) and weight > 0 for post, weight in weights.items())
    return False


def minimum_altitude(heights_m, eye, cells_m=(1.0, 1.0), drop_per_m2=0.0):
    """(altitude, crosses_unknown), (rows, cols) each, for an eye (row, col, altitude); cells_m = (north, east)."""
    heights_m = np.asarray(heights_m, float)
    rows, cols = heights_m.shape
    eye_row, eye_col, eye_m = eye
    rr, cc = np.mgrid[0:rows, 0:cols]
    d2 = ((rr - eye_row) * cells_m[0]) ** 2 + ((cc - eye_col) * cells_m[1]) ** 2
    lowered = heights_m - drop_per_m2 * d2
    edges = all_edges(rows, cols)
    a = edges[:, :2] - (eye_row, eye_col)
    b = edges[:, 2:] - (eye_row, eye_col)
    za = lowered[edges[:, 0].astype(int), edges[:, 1].astype(int)]
    zb = lowered[edges[:, 2].astype(int), edges[:, 3].astype(int)]
    starts_unknown = over_unknown(heights_m, eye_row, eye_col)
    altitude = np.full((rows, cols), np.nan)
    unknown = np.zeros((rows, cols), bool)
    for r in range(rows):
        for c in range(cols):
            ray = np.array([r - eye_row, c - eye_col], float)
            distance = np.sqrt(d2[r, c])
            if distance == 0.0:
                altitude[r, c] = heights_m[r, c]
                unknown[r, c] = starts_unknown
                continue
            side_a = ray[0] * a[:, 1] - ray[1] * a[:, 0]
            side_b = ray[0] * b[:, 1] - ray[1] * b[:, 0]
            # signed areas: an end within a billionth of the ray is on it
            side_a[np.abs(side_a) < 1e-9] = 0.0
            side_b[np.abs(side_b) < 1e-9] = 0.0
            crossing = (side_a * side_b <= 0) & ((side_a != 0) | (side_b != 0))
            f = np.where(crossing, side_a / np.where(crossing, side_a - side_b, 1.0), 0.0)
            at = a + (b - a) * f[:, None]
            along = (at @ ray) / (ray @ ray)
            hit = crossing & (along > 1e-9) & (along < 1.0 - 1e-12)
            # the end that has no weight must not spread its NaN
            height = np.where(f == 0.0, za, np.where(f == 1.0, zb, za + (zb - za) * f))
            slope = (height[hit] - eye_m) / (along[hit] * distance)
            unknown[r, c] = starts_unknown or np.isnan(slope).any() or np.isnan(heights_m[r, c])
            slope = slope[~np.isnan(slope)]
            line = eye_m + slope.max() * distance + drop_per_m2 * d2[r, c] if slope.size else -np.inf
            altitude[r, c] = line if np.isnan(heights_m[r, c]) else max(line, heights_m[r, c])
    return altitude, unknown
