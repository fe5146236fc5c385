"""The column-wise O(N) sweep: independent rays, one running maximum each (De Vivo, Battipede, Gili, II-B, eqs. 10-11).

Rays fan out from the anchor in four sectors, |across| <= |along| in post units. Along a sector the rays cross one row
(or column) of posts after the other; each keeps the steepest slope it has met, in metres per step along, and a post's
answer is interpolated between its two neighbouring rays. A ray's samples lie on the row, between two posts.

Sectors east and west run over columns. They transpose small tiles on the way, so that both kinds of sector read and
write the grid along its rows and each cache line travels once.
"""

import math

import numpy as np
from numba import float32, int32, prange, uint64

from .options import inner_loop, parallel_kernel, scalar_kernel

__all__ = ["BLOCK_RAYS", "REAL_COLUMNS", "TASK_COLUMNS", "owned_posts", "sweep"]

BLOCK_RAYS = 512
TILE = 16  # one cache line of float32
NEVER_BLOCKED = np.float32(-1e30)
GRAZING_TOLERANCE_M = np.float32(1e-3)  # float32 slopes over kilometres are good to about this

# one task = one block of rays in one sector of one anchor
TASK_COLUMNS = ("anchor", "axis", "direction", "first", "steps", "first_ray", "rays", "is_first_block", "is_last_block")
REAL_COLUMNS = ("along_0", "across_0", "altitude_m", "t_0", "dt", "drop_along", "drop_across")


@inner_loop
def _advance(ground, steepest, bend, count, lateral, ray):
    """Raise each ray's steepest slope by the ground it crosses on one line of posts."""
    start, step, last = lateral
    altitude, along, per_along = ray
    for q in range(count):
        across = start + step * float32(q)
        post = min(int32(across), last)
        part = across - float32(post)
        left = ground[uint64(post)]
        right = ground[uint64(post) + uint64(1)]
        slope = (left + (right - left) * part - altitude) * per_along - bend[q] * along
        steepest[q] = slope if slope > steepest[q] else steepest[q]


@inner_loop
def _answer(out, ground, steepest, count, fan, ray):
    """Altitude over each post of one line that clears what its two neighbouring rays have met."""
    q_0, dq, across_0, drop_0, drop_across = fan
    altitude, along = ray
    for i in range(count):
        q = q_0 + float32(i) * dq
        ray_left = int32(q)
        part = q - float32(ray_left)
        left = steepest[uint64(ray_left)]
        right = steepest[uint64(ray_left) + uint64(1)]
        across = across_0 + float32(i)
        clear = altitude + (left + (right - left) * part) * along + (drop_0 + drop_across * across * across)
        own = ground[i]
        out[i] = clear if not clear <= own + GRAZING_TOLERANCE_M else own


@scalar_kernel
def _sector_start(across_0, along, strict):
    """First whole post with across >= -along (> when strict), decided by the difference that both sectors compute."""
    post = math.ceil(across_0 - along)
    while post - across_0 < -along or (strict and post - across_0 == -along):
        post += 1
    while post - 1 - across_0 > -along or (not strict and post - 1 - across_0 == -along):
        post -= 1
    return int(post)


@scalar_kernel
def _sector_stop(across_0, along, strict):
    """One past the last whole post with across <= along (< when strict)."""
    post = math.floor(across_0 + along)
    while post - across_0 > along or (strict and post - across_0 == along):
        post -= 1
    while post + 1 - across_0 < along or (not strict and post + 1 - across_0 == along):
        post += 1
    return int(post) + 1


@scalar_kernel
def owned_posts(task, real, along, width):
    """Posts [start, stop) of one line that this block of rays answers for."""
    across_0, t_0, dt = real[1], real[3], real[4]
    strict = task[1] == 1
    if task[7] == 1:
        start = _sector_start(across_0, along, strict)
    else:
        start = int(math.ceil(across_0 + (t_0 + task[5] * dt) * along))
    if task[8] == 1:
        stop = _sector_stop(across_0, along, strict)
    else:
        stop = int(math.ceil(across_0 + (t_0 + (task[5] + task[6] - 1) * dt) * along))
    return max(start, 0), min(stop, width)


@scalar_kernel
def _line(task, real, index, width, ground, ground_start, out, steepest, bend):
    """Answer the owned posts of line ``index``, then let its ground raise the rays; returns the owned range.

    ground and out hold the line from post ``ground_start`` on.
    """
    along_0, across_0, altitude, t_0, dt, drop_along, drop_across = real
    along = abs(index - along_0)
    first_ray, rays = task[5], task[6]
    start, stop = owned_posts(task, real, along, width)
    t_first = t_0 + first_ray * dt
    if stop > start:
        dq = 1.0 / (along * dt)
        q_0 = max((start - across_0) * dq - t_first / dt, 0.0)
        fan = (
            float32(q_0),
            float32(dq),
            float32(start - across_0),
            float32(drop_along * along * along),
            float32(drop_across),
        )
        i = start - ground_start
        n = stop - start
        _answer(out[i : i + n], ground[i : i + n], steepest, n, fan, (float32(altitude), float32(along)))

    spacing = dt * along
    across = across_0 + t_first * along
    q_from, q_to = 0, rays
    if across < -1e-4:
        q_from = int(math.ceil((-1e-4 - across) / spacing))
    if across + (rays - 1) * spacing > width - 1 + 1e-4:
        q_to = int(math.floor((width - 1 + 1e-4 - across) / spacing)) + 1
    if q_to > q_from:
        across += q_from * spacing
        base = min(max(int(math.floor(across)), 0), width - 2)
        lateral = (float32(across - base), float32(spacing), int32(width - 2 - base))
        _advance(
            ground[base - ground_start :],
            steepest[q_from:q_to],
            bend[q_from:q_to],
            q_to - q_from,
            lateral,
            (float32(altitude), float32(along), float32(1.0 / along)),
        )
        steepest[rays] = steepest[rays - 1]
    return start, stop


@scalar_kernel
def _sweep_rows(heights, out, task, real, steepest, bend):
    width = heights.shape[1]
    for i in range(task[4]):
        index = task[3] + task[2] * i
        _line(task, real, index, width, heights[index], 0, out[index], steepest, bend)


@scalar_kernel
def _sweep_columns(heights, out, task, real, steepest, bend):
    rows = heights.shape[0]
    across_0, t_0, dt = real[1], real[3], real[4]
    t_first = t_0 + task[5] * dt
    t_last = t_first + (task[6] - 1) * dt
    direction, steps = task[2], task[4]
    ground = np.zeros((TILE, rows), np.float32)
    answer = np.zeros((TILE, rows), np.float32)
    start = np.zeros(TILE, np.int64)
    stop = np.zeros(TILE, np.int64)
    i = 0
    while i < steps:
        index = task[3] + direction * i
        # a tile ends where a cache line of the grid does
        n = index % TILE + 1 if direction < 0 else TILE - index % TILE
        n = min(n, steps - i)
        west = index if direction > 0 else index - n + 1
        near = abs(index - real[0])
        far = abs(index + direction * (n - 1) - real[0])
        top = int(math.floor(across_0 + min(t_first * near, t_first * far))) - 1
        bottom = int(math.ceil(across_0 + max(t_last * near, t_last * far))) + 2
        top = min(max(top, 0), max(rows - 2, 0))
        bottom = max(min(bottom, rows - 1), min(top + 1, rows - 1))
        for row in range(top, bottom + 1):
            for k in range(n):
                ground[k, row - top] = heights[row, west + k]
        for k in range(n):
            line = k if direction > 0 else n - 1 - k
            start[line], stop[line] = _line(
                task, real, west + line, rows, ground[line], top, answer[line], steepest, bend
            )
        first = start[:n].min()
        last = stop[:n].max()
        for row in range(first, last):
            for k in range(n):
                if start[k] <= row < stop[k]:
                    out[row, west + k] = answer[k, row - top]
        i += n


@parallel_kernel
def sweep(heights, out, tasks, reals, bins):
    """Fill out (n_anchors, rows, cols) with the altitude that clears the ground on the way to each anchor.

    heights: (rows, cols) float32, at least 2 x 2; NaN posts block nothing and stay NaN where they are the target.
    tasks, reals: one row per block of rays, columns TASK_COLUMNS and REAL_COLUMNS; drop_along and drop_across are
        curvature drops in metres per square step. bins: (workers, most) int64, tasks of each worker, -1 = none.
    """
    for worker in prange(bins.shape[0]):
        steepest = np.zeros(BLOCK_RAYS + 2, np.float32)
        bend = np.zeros(BLOCK_RAYS + 2, np.float32)
        for slot in range(bins.shape[1]):
            number = bins[worker, slot]
            if number >= 0:
                task = tasks[number]
                t_0, dt, drop_along, drop_across = (
                    reals[number, 3],
                    reals[number, 4],
                    reals[number, 5],
                    reals[number, 6],
                )
                for q in range(task[6]):
                    t = t_0 + (task[5] + q) * dt
                    bend[q] = drop_along + drop_across * t * t
                steepest[:] = NEVER_BLOCKED
                real = (
                    reals[number, 0],
                    reals[number, 1],
                    reals[number, 2],
                    t_0,
                    dt,
                    drop_along,
                    drop_across,
                )
                if task[1] == 0:
                    _sweep_rows(heights, out[task[0]], task, real, steepest, bend)
                else:
                    _sweep_columns(heights, out[task[0]], task, real, steepest, bend)
