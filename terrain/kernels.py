"""Kernels over the triangulated surface: sampling heights at fractional post positions."""

import numba
import numpy as np

__all__ = ["surface_height", "surface_heights"]


@numba.njit(cache=True, error_model="numpy")
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


@numba.njit(cache=True, error_model="numpy")
def surface_heights(heights_m, row, col, out_m):
    """Fill out_m (n,) with the surface height at each fractional (row, col)."""
    for i in range(row.shape[0]):
        out_m[i] = surface_height(heights_m, row[i], col[i])
