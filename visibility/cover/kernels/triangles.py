"""Meshes: where rays meet them first, their nearest place, and which bodies hold a point.

Rays after Möller and Trumbore (De Vivo et al., eqs. 12-14). The nearest place is sought through boxes around ever more
triangles: a node of level 0 of the tree is LEAF triangles that follow each other; one above is two of those below.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel
from terrain.kernels.triangle import nearest_on_triangle

__all__ = ["LEAF", "Tree", "bodies_around", "first_hits", "nearest_on_mesh"]

LEAF = 4
# two children of every level but the last, of at most 32 levels
STACK = 64

FIRST, COUNT = 0, 1  # columns of levels
FACES, FLOOR, STOP = 0, 1, 2  # columns of bodies: its first triangle, the first that is floor, the first of the next
LOW, HIGH = 0, 1  # corners of a box


class Tree(NamedTuple):
    """Corners of the box around each node, (nodes, 3), finest level first; levels: (n, 2) first node, how many."""

    low_m: Any
    high_m: Any
    levels: Any


@scalar_kernel
def _corner(corners_m, t, k):
    return corners_m[t, k, 0], corners_m[t, k, 1], corners_m[t, k, 2]


@scalar_kernel
def _box_distance2(point, low_m, high_m, node):
    """Squared distance to the box around a node, which nothing in it can be nearer than."""
    total = 0.0
    for axis in range(3):
        out_m = max(low_m[node, axis] - point[axis], point[axis] - high_m[node, axis], 0.0)
        total += out_m * out_m
    return total


@scalar_kernel
def _among(point, corners_m, first, stop, least2, best):
    """(place, squared distance) of the nearest of the triangles from first to stop; as told where none is nearer."""
    for t in range(first, stop):
        place, distance2 = nearest_on_triangle(
            point, _corner(corners_m, t, 0), _corner(corners_m, t, 1), _corner(corners_m, t, 2)
        )
        if distance2 < least2:
            best, least2 = place, distance2
    return best, least2


@parallel_kernel
def nearest_on_mesh(points_m, corners_m, tree, nearest_m, distance_m):
    """Fill nearest_m (n, 3) and distance_m (n,), never negative. corners_m: (m, 3, 3) in the order of the tree."""
    low_m, high_m, levels = tree
    for p in prange(points_m.shape[0]):
        point = (points_m[p, 0], points_m[p, 1], points_m[p, 2])
        best, least2 = (math.nan, math.nan, math.nan), math.inf
        nodes, depths, bounds = np.empty(STACK, np.int64), np.empty(STACK, np.int64), np.empty(STACK)
        nodes[0], depths[0], bounds[0] = 0, levels.shape[0] - 1, 0.0
        waiting = 1
        while waiting > 0:
            waiting -= 1
            if bounds[waiting] >= least2:
                continue
            node, level = nodes[waiting], depths[waiting]
            if level == 0:
                stop = min((node + 1) * LEAF, corners_m.shape[0])
                best, least2 = _among(point, corners_m, node * LEAF, stop, least2, best)
                continue
            left, right = 2 * node, min(2 * node + 1, levels[level - 1, COUNT] - 1)
            base = levels[level - 1, FIRST]
            to_left, to_right = (
                _box_distance2(point, low_m, high_m, base + left),
                _box_distance2(point, low_m, high_m, base + right),
            )
            if to_left < to_right:  # the nearer on top, so that it is looked into first
                left, right, to_left, to_right = right, left, to_right, to_left
            if to_left < least2 and left != right:
                nodes[waiting], depths[waiting], bounds[waiting] = left, level - 1, to_left
                waiting += 1
            if to_right < least2:
                nodes[waiting], depths[waiting], bounds[waiting] = right, level - 1, to_right
                waiting += 1
        nearest_m[p, 0], nearest_m[p, 1], nearest_m[p, 2] = best
        distance_m[p] = math.sqrt(least2)


@scalar_kernel
def _edge_is_east(point, a, b):
    """Whether the edge crosses the line east of a point, seen from above; the same from either end."""
    if (a[1] > point[1]) == (b[1] > point[1]):
        return False
    if a[1] > b[1]:
        a, b = b, a
    return a[0] + (point[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) > point[0]


@scalar_kernel
def _is_above(point, a, b, c):
    """Whether the triangle is straight above a point; of triangles that share an edge, one has what is on it."""
    over = _edge_is_east(point, a, b) != _edge_is_east(point, b, c)
    if over == _edge_is_east(point, c, a):
        return False
    determinant = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
    if determinant == 0.0:
        return False
    v = ((point[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (point[1] - a[1])) / determinant
    w = ((b[0] - a[0]) * (point[1] - a[1]) - (point[0] - a[0]) * (b[1] - a[1])) / determinant
    return a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2]) > point[2]


@parallel_kernel
def bodies_around(points_m, corners_m, bodies, boxes_m, nearest_m, distance_m):
    """Overwrite nearest_m (n, 3) and distance_m (n,), negative then, of each point that a body is around.

    corners_m: (m, 3, 3), body after body. bodies: (b, 3) FACES, FLOOR, STOP. boxes_m: (b, 2, 3) LOW, HIGH.
    A body is around a point when an odd number of its triangles is straight above; of several the one that is hardest
    to leave counts. Nobody leaves through the floor.
    """
    for p in prange(points_m.shape[0]):
        point = (points_m[p, 0], points_m[p, 1], points_m[p, 2])
        for b in range(bodies.shape[0]):
            near = True
            for axis in range(3):
                near = near and boxes_m[b, LOW, axis] <= point[axis] <= boxes_m[b, HIGH, axis]
            if not near:
                continue
            odd = False
            for t in range(bodies[b, FACES], bodies[b, STOP]):
                a, c, d = _corner(corners_m, t, 0), _corner(corners_m, t, 1), _corner(corners_m, t, 2)
                odd = odd != _is_above(point, a, c, d)
            if not odd:
                continue
            best, least2 = (math.nan, math.nan, math.nan), math.inf
            best, least2 = _among(point, corners_m, bodies[b, FACES], bodies[b, FLOOR], least2, best)
            if -math.sqrt(least2) < min(distance_m[p], 0.0):
                nearest_m[p, 0], nearest_m[p, 1], nearest_m[p, 2] = best
                distance_m[p] = -math.sqrt(least2)


# Barycentric slack, so that a ray through a shared edge cannot slip between its two triangles.
SEAM = 1e-9


@scalar_kernel
def _hit(origin, direction, corner, edge_1, edge_2):
    """The t at which origin + t·direction meets a triangle; +inf where it does not, or lies in its plane."""
    # solve [-D, E1, E2] (t, u, v)ᵀ = O - V0 by Cramer's rule, with P = D × E2 and Q = T × E1
    px = direction[1] * edge_2[2] - direction[2] * edge_2[1]
    py = direction[2] * edge_2[0] - direction[0] * edge_2[2]
    pz = direction[0] * edge_2[1] - direction[1] * edge_2[0]
    determinant = px * edge_1[0] + py * edge_1[1] + pz * edge_1[2]
    if determinant == 0.0:
        return math.inf
    tx, ty, tz = origin[0] - corner[0], origin[1] - corner[1], origin[2] - corner[2]
    u = (tx * px + ty * py + tz * pz) / determinant
    if not -SEAM <= u <= 1.0 + SEAM:
        return math.inf
    qx = ty * edge_1[2] - tz * edge_1[1]
    qy = tz * edge_1[0] - tx * edge_1[2]
    qz = tx * edge_1[1] - ty * edge_1[0]
    v = (direction[0] * qx + direction[1] * qy + direction[2] * qz) / determinant
    if not (v >= -SEAM and u + v <= 1.0 + SEAM):
        return math.inf
    return (edge_2[0] * qx + edge_2[1] * qy + edge_2[2] * qz) / determinant


@parallel_kernel
def first_hits(start, end, corner, edge_1, edge_2, t_first):
    """Fill t_first (n,) with the least t in 0..1 at which the segment from start to end, (n, 3), meets a triangle.

    corner, edge_1, edge_2: (m, 3) first vertex and the edges from it. t_first is +inf where nothing is met.
    """
    for i in prange(start.shape[0]):
        origin = (start[i, 0], start[i, 1], start[i, 2])
        direction = (end[i, 0] - origin[0], end[i, 1] - origin[1], end[i, 2] - origin[2])
        first = math.inf
        for k in range(corner.shape[0]):
            t = _hit(origin, direction, corner[k], edge_1[k], edge_2[k])
            if 0.0 <= t <= 1.0 and t < first:
                first = t
        t_first[i] = first
