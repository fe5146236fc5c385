"""Slow obvious oracle for the triangulated surface: solve the plane through three posts. Imports nothing of ours."""

import math

import numpy as np


def surface_height(heights_m, row, col):
    """Height at a fractional (row, col); NaN outside and where a vertex that carries weight is unknown."""
    rows, cols = heights_m.shape
    if not (0 <= row <= rows - 1 and 0 <= col <= cols - 1):
        return math.nan
    found = []
    for r in range(max(rows - 1, 1)):
        for c in range(max(cols - 1, 1)):
            square = [(r, c), (r + 1, c), (r + 1, c + 1), (r, c + 1)]
            for triangle in ([square[0], square[1], square[2]], [square[0], square[2], square[3]]):
                weights = barycentric(triangle, row, col)
                if min(weights) >= -1e-12:
                    found.append(weighted(heights_m, triangle, weights))
    known = [height for height in found if not math.isnan(height)]
    return known[0] if known else math.nan


def barycentric(triangle, row, col):
    matrix = np.array([[r, c, 1.0] for r, c in triangle]).T
    return np.linalg.solve(matrix, [row, col, 1.0])


def weighted(heights_m, triangle, weights):
    """A vertex without weight is not looked at: it may be unknown, or lie beyond a grid of one row or column."""
    total = 0.0
    for (r, c), weight in zip(triangle, weights, strict=True):
        if weight > 1e-12:
            inside = r < heights_m.shape[0] and c < heights_m.shape[1]
            total += weight * float(heights_m[r, c]) if inside else math.nan
    return total
