"""Turning grids, so that what runs over columns reads and writes along rows."""

from numba import prange

from compiled.options import inner_loop, parallel_kernel
from compiled.vectors import BLOCK, prefetch, turn_block

__all__ = ["CACHE_LINE", "TILE", "turn", "turn_in", "turn_out"]

TILE = 64  # columns turned at once: four cache lines of float32
CACHE_LINE = 16  # float32
START, STOP = 0, 1
ROWS_AHEAD = 32  # whose places in memory the processor does not foresee


@inner_loop
def turn_in(heights, where, lines):
    """Copy a tile of the grid, rows [top, bottom) of n columns from west on, into lines (lines, rows)."""
    top, bottom, west, n = where
    rows, cols = bottom - top, n // BLOCK * BLOCK
    for row in range(0, rows - BLOCK + 1, BLOCK):
        for ahead in range(top + row + ROWS_AHEAD, min(top + row + ROWS_AHEAD + BLOCK, bottom)):
            for k in range(0, n, CACHE_LINE):
                prefetch(heights, ahead, west + k)
        for k in range(0, cols, BLOCK):
            turn_block(heights, top + row, west + k, lines, k, row)
    for row in range(rows):
        for k in range(cols if row < rows // BLOCK * BLOCK else 0, n):
            lines[k, row] = heights[top + row, west + k]


@inner_loop
def turn_out(lines, where, start, stop, whole, out):
    """Copy what each line owns, rows [start, stop), from lines (lines, rows from top on) into a tile of the grid.

    where: (first row of lines, first row that any line owns, one past the last, first column of the tile, columns).
    whole: (TILE / BLOCK, 2) START and STOP of the rows that all of so many lines own.
    """
    top, first, last, west, n = where
    for row in range(first, last, BLOCK):
        for ahead in range(row + ROWS_AHEAD, min(row + ROWS_AHEAD + BLOCK, last)):
            for k in range(0, n, CACHE_LINE):
                prefetch(out, ahead, west + k)
        for k in range(0, n, BLOCK):
            if whole[k // BLOCK, START] <= row and row + BLOCK <= whole[k // BLOCK, STOP]:
                turn_block(lines, k, row - top, out, row, west + k)
            else:
                for line in range(k, min(k + BLOCK, n)):
                    for own in range(max(row, start[line]), min(row + BLOCK, stop[line])):
                        out[own, west + line] = lines[line, own - top]


@parallel_kernel
def turn(heights, out):
    """Fill out (cols, rows) with heights (rows, cols), both float32."""
    rows, cols = heights.shape
    for tile in prange((cols + TILE - 1) // TILE):
        west = tile * TILE
        turn_in(heights, (0, rows, west, min(TILE, cols - west)), out[west:])
