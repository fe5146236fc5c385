"""Slow obvious oracle for buildings: the lowest altitude from which an eye is seen past solids, by trying altitudes.

Imports nothing of ours. A solid is a list of triangles (m, 3, 3), walls, roof and floor, in a frame where sight lines
are straight. A point sees the eye when the segment between them meets no triangle; the altitude at which that begins is
sought by halving.
"""

import numpy as np


def meets(triangles, start, end):
    """Whether a segment meets any of the triangles, by solving for the three unknowns of each."""
    way = end - start
    for corner, one, other in triangles:
        matrix = np.column_stack([-way, one - corner, other - corner])
        if abs(np.linalg.det(matrix)) < 1e-12:
            continue
        t, u, v = np.linalg.solve(matrix, start - corner)
        if 0 <= t <= 1 and u >= 0 and v >= 0 and u + v <= 1:
            return True
    return False


def lowest_clear(triangles, eye, east, north, low, high, within=1e-5):
    """Lowest altitude in low..high over (east, north) that sees the eye past solids that reach the ground."""
    if not meets(triangles, np.array(eye, float), np.array([east, north, low], float)):
        return low
    while high - low > within:
        middle = (low + high) / 2
        if meets(triangles, np.array(eye, float), np.array([east, north, middle], float)):
            low = middle
        else:
            high = middle
    return high


def prism(ring, base, top):
    """Triangles of a convex prism: ring (n, 2), in order, from base to top."""
    n = len(ring)
    lower = [np.array([*place, base], float) for place in ring]
    upper = [np.array([*place, top], float) for place in ring]
    found = []
    for i in range(n):
        j = (i + 1) % n
        found += [(lower[i], lower[j], upper[j]), (lower[i], upper[j], upper[i])]
    for i in range(1, n - 1):
        found += [(upper[0], upper[i], upper[i + 1]), (lower[0], lower[i], lower[i + 1])]
    return found
