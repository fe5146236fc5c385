"""Slow obvious oracle for ways through canopy: thousands of points along the line, each asked where it is.

Imports nothing of ours.
"""

import numpy as np


def on_triangles(values, row, col):
    """Value at a fractional post of the triangulation with diagonals (r, c)-(r+1, c+1)."""
    r, c = min(int(row), values.shape[0] - 2), min(int(col), values.shape[1] - 2)
    down, across = row - r, col - c
    side = values[r + 1, c] if down > across else values[r, c + 1]
    weights = 1 - max(down, across), abs(down - across), min(down, across)
    return weights[0] * values[r, c] + weights[1] * side + weights[2] * values[r + 1, c + 1]


def way_through(heights, tops, bases, cell, start, end, points=20_000, densities=None):
    """Metres of the line from start to end, (row, col, altitude) each, between bases and tops over flat-body ground.

    densities: by which each metre counts; None = all alike.
    """
    start, end = np.array(start, float), np.array(end, float)
    inside = 0
    for share in (np.arange(points) + 0.5) / points:
        row, col, altitude = start + share * (end - start)
        above = altitude - on_triangles(heights, row, col)
        top = on_triangles(tops, row, col)
        counts = 1.0 if densities is None else on_triangles(densities, row, col)
        inside += counts if top > 0 and on_triangles(bases, row, col) <= above <= top else 0.0
    metres = np.linalg.norm((end - start) * np.array([cell, cell, 1.0]))
    return inside / points * metres
