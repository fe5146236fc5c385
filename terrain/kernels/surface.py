"""Kernels over the triangulated surface: sampling heights at fractional post positions."""

import numpy as np

from compiled.options import scalar_kernel

__all__ = ["resample_surface", "settled", "surface_height", "surface_heights"]


@scalar_kernel
def surface_height(heights_m, row, col):
    """Height of the triangulated surface at a fractional (row, col); NaN outside and on unknown ground."""
    rows, cols = heights_m.shape
    if not (row >= 0.0 and row <= rows - 1 and col >= 0.0 and col <= cols - 1):
        return np.nan
    top = min(int(row), max(rows - 2, 0))
    left = min(int(col), max(cols - 2, 0))
    bottom = min(top + 1, rows - 1)
    right = min(left + 1, cols - 1)
    down = row - top
    across = col - left
    # barycentric weights; a vertex without weight must not spread its NaN
    corner = float(heights_m[top, left])
    far = float(heights_m[bottom, right])
    if down >= across:
        height_m = 0.0
        if down < 1.0:
            height_m += (1.0 - down) * corner
        if down > across:
            height_m += (down - across) * float(heights_m[bottom, left])
        if across > 0.0:
            height_m += across * far
        return height_m
    height_m = 0.0
    if across < 1.0:
        height_m += (1.0 - across) * corner
    height_m += (across - down) * float(heights_m[top, right])
    if down > 0.0:
        height_m += down * far
    return height_m


@scalar_kernel
def settled(position):
    """A fractional row or column; within a millionth of a cell of a post it is that post: rounding crosses no edge."""
    nearest = np.floor(position + 0.5)
    return nearest if abs(position - nearest) < 1e-6 else position


@scalar_kernel
def surface_heights(heights_m, row, col, out_m):
    """Fill out_m (n,) with the surface height at each fractional (row, col)."""
    for i in range(row.shape[0]):
        out_m[i] = surface_height(heights_m, settled(row[i]), settled(col[i]))


@scalar_kernel
def resample_surface(heights_m, lattice_rows, lattice_cols, step, out_m):
    """Fill out_m (r, c) with the surface height at source positions known on every ``step``-th post of out_m.

    lattice_rows, lattice_cols: source (row, col) of out_m's posts (i·step, j·step); linear between. NaN stays NaN.
    """
    last_i, last_j = lattice_rows.shape[0] - 2, lattice_rows.shape[1] - 2
    for r in range(out_m.shape[0]):
        i = min(r // step, max(last_i, 0))
        i1 = min(i + 1, last_i + 1)
        v = (r - i * step) / step
        for c in range(out_m.shape[1]):
            j = min(c // step, max(last_j, 0))
            j1 = min(j + 1, last_j + 1)
            u = (c - j * step) / step
            w00, w01, w10, w11 = (1.0 - v) * (1.0 - u), (1.0 - v) * u, v * (1.0 - u), v * u
            row = w00 * lattice_rows[i, j] + w01 * lattice_rows[i, j1]
            row += w10 * lattice_rows[i1, j] + w11 * lattice_rows[i1, j1]
            col = w00 * lattice_cols[i, j] + w01 * lattice_cols[i, j1]
            col += w10 * lattice_cols[i1, j] + w11 * lattice_cols[i1, j1]
            out_m[r, c] = surface_height(heights_m, settled(row), settled(col))
