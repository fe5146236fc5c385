"""The column-wise O(N) sweep: independent rays, one running maximum each (De Vivo, Battipede, Gili, II-B, eqs. 10-11).

Rays fan out from the eye in four sectors, |across| <= |along| in post units. Along a sector the rays cross one row (or
column) of posts after the other; each keeps the steepest slope it has met, in metres per step along, and a post's
answer is interpolated between its two neighbouring rays. Near the eye few rays run; whenever they have spread by half a
post their number doubles, until at the far end they are one post apart. Sectors east and west run over columns; they
turn small tiles on the way, so that both kinds of sector read and write the grid along its rows and each cache line
travels once.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import float32, int64, prange

from compiled.options import parallel_kernel, scalar_kernel
from compiled.vectors import BLOCK
from visibility.sight.kernels.blocks import block_of
from visibility.sight.kernels.sweep_lines import Line, Rays, first_strip, rays_on_map, sweep_line
from visibility.sight.kernels.sweep_loops import BEND, NO_GROUND, NOT_BLOCKED, PER_ACROSS, PER_LEAN, STRIDE, Ahead
from visibility.sight.kernels.turning import TILE, turn_in, turn_out

__all__ = ["BLOCK_RAYS", "COARSEST", "WIDEST_GAP", "sweep"]

BLOCK_RAYS = 2048
COARSEST = 16  # near the eye only every 16th ray runs, or fewer are left out
WIDEST_GAP = 0.5  # posts between neighbouring rays, as long as there are rays left to start
LINES_AHEAD = 3
RAY_ROOM = 2 * BLOCK_RAYS + 2 * STRIDE  # a block has at most twice its rays; vectors reach over the last
TILE_ROOM = 2 * BLOCK_RAYS + 3 * TILE + 8  # rows a tile can span; no power of two, or its lines would share cache sets


class Ground(NamedTuple):
    """What ``sweep`` is told of the ground: heights, the same turned, and a line of NaN."""

    heights: Any
    turned: Any
    blank: Any


@scalar_kernel
def _load_rays(block, stride, fan):
    """Per-ray numbers: bend (curvature), and how far back a ray meets a diagonal or a straight edge per post across."""
    for q in range((block.rays - 1) // stride + 1):
        t = block.t_0 + (block.first_ray + q * stride) * block.dt
        fan[BEND, q] = block.drop_along_m + block.drop_across_m * t * t
        leaning = t * block.direction
        fan[PER_LEAN, q] = 1.0 / (1.0 - leaning) if leaning < 1.0 else 1e30
        fan[PER_ACROSS, q] = 1.0 / leaning if leaning > 0.0 else 0.0


@scalar_kernel
def _first_stride(block):
    """Every how many rays run at first: fewer are left out where the sector is short."""
    near = max(abs(block.first_line - block.along_0), 1.0)
    stride = block.coarsest
    while stride > 1 and near * block.dt * stride > WIDEST_GAP:
        stride //= 2
    return stride


@scalar_kernel
def _refine(along, block, stride, rays, width):
    """Double the rays until they are close enough together at this distance; returns the new stride."""
    steepest = rays.steepest
    left_end, right_end = rays_on_map(block.across_0, width)
    while stride > 1 and along * block.dt * stride > WIDEST_GAP:
        count = (block.rays - 1) // stride + 1
        for q in range(count - 1, 0, -1):
            left, right = steepest[q - 1], steepest[q]
            steepest[2 * q] = right
            if left > NO_GROUND and right > NO_GROUND:
                between = float32(0.5) * (left + right)
            else:
                # only one of them has come onto the map: so has the one between them, or not yet
                t = block.t_0 + (block.first_ray + (q - 0.5) * stride) * block.dt
                across = block.across_0 + t * (along - 1.0)
                between = max(left, right) if left_end <= across <= right_end else NO_GROUND
            steepest[2 * q - 1] = between
        steepest[2 * count - 1] = steepest[2 * count - 2]
        stride //= 2
        _load_rays(block, stride, rays.fan)
    return stride


@scalar_kernel
def _row_ahead(index, direction, rows):
    ahead = index + LINES_AHEAD * direction
    return ahead if 0 <= ahead < rows else -1


@scalar_kernel
def _sweep_rows(ground, out, block, stride, rays):
    heights, before = ground.heights, ground.blank
    rows, width = heights.shape
    for i in range(block.lines):
        index = block.first_line + block.direction * i
        stride = _refine(abs(index - block.along_0), block, stride, rays, width)
        row_ahead = _row_ahead(index, block.direction, rows)
        ahead = Ahead(heights, row_ahead, out, row_ahead)
        sweep_line(block, index, stride, Line(heights[index], before, int64(0), width, ahead), out[index], rays)
        before = heights[index]


@scalar_kernel
def _rows_reached(block, near, far, rows):
    """First and last row, two at least, that the rays of a block can touch between two lines of posts."""
    across_0 = block.across_0
    t_first = block.t_0 + block.first_ray * block.dt
    t_last = t_first + (block.rays - 1) * block.dt
    top = math.floor(across_0 + min(t_first * near, t_first * far)) - 1
    bottom = math.ceil(across_0 + max(t_last * near, t_last * far)) + 2
    top = min(max(top, 0), rows - 2)
    return top, max(min(bottom, rows - 1), top + 1)


@scalar_kernel
def _sweep_columns(ground, out, block, stride, rays, tile, shift):
    heights, turned = ground.heights, ground.turned
    rows = heights.shape[0]
    is_turned = turned.shape[0] > 0
    direction, lines = block.direction, block.lines
    posts, answered = tile
    posts[TILE] = np.nan  # the line before the tile
    start = np.zeros(TILE, np.int64)
    stop = np.zeros(TILE, np.int64)
    whole = np.zeros((TILE // BLOCK, 2), np.int64)
    i, top, bottom, farthest = 0, 0, 0, 0
    while i < lines:
        past_top, past_bottom = top, bottom
        index = block.first_line + direction * i
        # a tile ends where a cache line of the grid does
        beyond = (index + shift) % TILE
        n = beyond + 1 if direction < 0 else TILE - beyond
        n = min(n, lines - i)
        west = index if direction > 0 else index - n + 1
        near = abs(index - block.along_0)
        far = abs(index + direction * (n - 1) - block.along_0)
        top, bottom = _rows_reached(block, near, far, rows)
        if not is_turned:
            # the line before is the last one of the tile before, as far as the rays of this tile can have come from
            shared = slice(max(top, past_top), max(min(bottom, past_bottom) + 1, top))
            if i > 0:
                posts[TILE, : bottom + 1 - top] = np.nan
                posts[TILE, shared.start - top : shared.stop - top] = posts[
                    farthest, shared.start - past_top : shared.stop - past_top
                ]
            turn_in(heights, (top, bottom + 1, west, n), posts)
        for k in range(n):
            line = k if direction > 0 else n - 1 - k
            stride = _refine(abs(west + line - block.along_0), block, stride, rays, rows)
            here, before = posts[line], posts[TILE if k == 0 else line - direction]
            ahead = Ahead(turned, _row_ahead(west + line, direction, turned.shape[0]), out, int64(-1))
            if is_turned:
                here = turned[west + line, top:]
                before = turned[west + line - direction, top:] if i + k > 0 else ground.blank
            seen = Line(here, before, top, rows, ahead)
            start[line], stop[line] = sweep_line(block, west + line, stride, seen, answered[line], rays)
        farthest = n - 1 if direction > 0 else 0
        for group in range(len(whole)):
            some = slice(group * BLOCK, group * BLOCK + BLOCK)
            # fewer lines are not turned as a block
            whole[group] = (start[some].max(), stop[some].min()) if some.stop <= n else (0, 0)
        turn_out(answered, (top, start[:n].min(), stop[:n].max(), west, n), start, stop, whole, out)
        i += n


@parallel_kernel
def sweep(heights, turned, blank, out, blocks, bins, shift):
    """Fill out (n_eyes, rows, cols) with the altitude that clears the ground on the way to each eye.

    heights: (rows, cols) float32, at least 2 x 2; NaN posts block nothing.
    turned: the same (cols, rows), which serves many eyes at once; or (0, 0): tiles are turned on the way.
    blank: NaN, as many as a line has posts: the line before the first.
    blocks: (n,) of BLOCK_FIELDS. bins: (workers, most) int64, the blocks of each worker, -1 = none.
    shift: float32 between the start of a cache line and that of out; tiles end where cache lines do.
    """
    for worker in prange(bins.shape[0]):
        steepest = np.zeros(RAY_ROOM, np.float32)
        fan = np.zeros((3, RAY_ROOM), np.float32)
        rays = Rays(steepest, fan, np.zeros(STRIDE, np.int32), np.zeros((3, STRIDE), np.float32))
        room = min(TILE_ROOM, heights.shape[0] + 3 * TILE + 8)
        tile = (np.empty((TILE + 1, room), np.float32), np.empty((TILE, room), np.float32))
        ground = Ground(heights, turned, blank)
        for slot in range(bins.shape[1]):
            number = bins[worker, slot]
            if number >= 0:
                block = block_of(blocks, number)
                steepest[:] = NOT_BLOCKED if block.is_eye_inside else NO_GROUND
                stride = _first_stride(block)
                _load_rays(block, stride, fan)
                if block.axis == 0:
                    first_strip(heights, block, stride, steepest)
                    _sweep_rows(ground, out[block.eye], block, stride, rays)
                else:
                    first_strip(heights.T, block, stride, steepest)
                    _sweep_columns(ground, out[block.eye], block, stride, rays, tile, shift)
