"""Ray-triangle intersection after Möller and Trumbore (De Vivo et al., eqs. 12-14)."""

import math

from numba import prange

from compiled.options import parallel_kernel, scalar_kernel

__all__ = ["first_hits"]

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
