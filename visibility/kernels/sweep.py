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
def _advance(ground, before, steepest, rays, count, lateral, eye):
    """Raise each ray's steepest slope by the edge of this line that it crosses and the last edge before it.

    ground, before: this line of posts and the one on the eye's side. rays: (bend, across, per_lean, per_across), see _load_rays.
    """
    start, step, last, lean = lateral
    altitude, along, per_along = eye
    bend, per_lean, per_across = rays
    one = float32(1.0)
    for q in range(count):
        across = start + step * float32(q)
        post = min(int32(across), last)
        part = across - float32(post)
        left = ground[uint64(post)]
        right = ground[uint64(post) + uint64(1)]
        behind = before[uint64(post)]
        slope = (left + (right - left) * part - altitude) * per_along - bend[q] * along
        part = one - part if lean > 0 else part
        first = right if lean > 0 else left
        second = left if lean > 0 else right
        to_diagonal = part * per_lean[q]
        to_straight = (one - part) * per_across[q]
        diagonal = to_diagonal <= one
        reach = to_diagonal if diagonal else to_straight
        here = first if diagonal else second
        there = along - reach
        cross = (here + (behind - here) * reach - altitude) / there - bend[q] * there
        steepest_q = slope if slope > steepest[q] else steepest[q]
        steepest[q] = cross if cross > steepest_q else steepest_q


@inner_loop
def _answer(out, own, aside, before, steepest, fan, eye):
    """Altitude over each post of one line that clears what its two neighbouring rays have met, and its last diagonal.

    own: heights of the posts; aside: of their neighbours on this line, before: of the posts on the line before, which
    together hold the one edge that a sight line to a post can still cross after the line before.
    """
    q_0, dq, across_0, drop_0, drop_across, lean = fan
    altitude, along, per_along = eye
    one = float32(1.0)
    for i in range(out.shape[0]):
        q = q_0 + float32(i) * dq
        ray_left = int32(q)
        part = q - float32(ray_left)
        left = steepest[uint64(ray_left)]
        right = steepest[uint64(ray_left) + uint64(1)]
        across = across_0 + float32(i)
        drop = drop_0 + drop_across * across * across
        slope = left + (right - left) * part
        bearing = across * per_along * lean
        reach = one / (one - bearing)
        there = along - reach
        edge = aside[i] + (before[i] - aside[i]) * reach
        last = (edge - altitude) / there - drop * there * per_along * per_along
        last = last if bearing < float32(0.0) else slope
        slope = last if last > slope else slope
        clear = altitude + slope * along + drop
        out[i] = clear if not clear <= own[i] + GRAZING_TOLERANCE_M else own[i]


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
def _line(task, real, index, width, lines, out, steepest, rays):
    """Answer the owned posts of line ``index``, then let its ground raise the rays; returns the owned range.

    lines: (this line, the one before it, their first post); out holds the line from the same post on.
    """
    ground, before, ground_start = lines
    bend, per_lean, per_across, nothing = rays
    along_0, across_0, altitude, t_0, dt, drop_along, drop_across = real
    along = abs(index - along_0)
    first_ray, ray_count = task[5], task[6]
    start, stop = owned_posts(task, real, along, width)
    t_first = t_0 + first_ray * dt
    lean = task[2]
    # the outermost post has no neighbour aside on one side of the map, and no sight line comes from there
    inner_start = max(start, 1) if lean < 0 else start
    inner_stop = min(stop, width - 1) if lean > 0 else stop
    eye = (float32(altitude), float32(along), float32(1.0 / along))
    for part in range(3):
        first, last = inner_start, inner_stop
        if part == 1:
            first, last = start, inner_start
        elif part == 2:
            first, last = inner_stop, stop
        if last > first:
            dq = 1.0 / (along * dt)
            fan = (
                float32(max((first - across_0) * dq - t_first / dt, 0.0)),
                float32(dq),
                float32(first - across_0),
                float32(drop_along * along * along),
                float32(drop_across),
                float32(lean),
            )
            i = first - ground_start
            n = last - first
            own = ground[i : i + n]
            aside = ground[i + lean : i + lean + n] if part == 0 else nothing
            _answer(out[i : i + n], own, aside, before[i : i + n], steepest, fan, eye)

    spacing = dt * along
    across = across_0 + t_first * along
    q_from, q_to = 0, ray_count
    if across < -1e-4:
        q_from = int(math.ceil((-1e-4 - across) / spacing))
    if across + (ray_count - 1) * spacing > width - 1 + 1e-4:
        q_to = int(math.floor((width - 1 + 1e-4 - across) / spacing)) + 1
    if q_to > q_from:
        across += q_from * spacing
        base = min(max(int(math.floor(across)), 0), width - 2)
        lateral = (float32(across - base), float32(spacing), int32(width - 2 - base), lean)
        back = base - ground_start + (0 if lean > 0 else 1)
        _advance(
            ground[base - ground_start :],
            before[back:],
            steepest[q_from:q_to],
            (bend[q_from:q_to], per_lean[q_from:q_to], per_across[q_from:q_to]),
            q_to - q_from,
            lateral,
            eye,
        )
        steepest[ray_count] = steepest[ray_count - 1]
    return start, stop


@scalar_kernel
def _first_strip(lines, task, real, steepest):
    """Start each ray with the edges that it crosses between the eye and the sector's first line of posts.

    The nearer line of that strip lies at or behind the eye; lines[index, post] are heights.
    """
    along_0, across_0, altitude, t_0, dt, drop_along, drop_across = real
    first, direction = task[3], task[2]
    before = first - direction
    if not 0 <= before < lines.shape[0]:
        return
    width = lines.shape[1]
    near, far = (before - along_0) * direction, abs(first - along_0)
    middle = int(math.floor(across_0))
    for q in range(task[6]):
        t = t_0 + (task[5] + q) * dt
        for post in range(max(middle - 1, 0), min(middle + 3, width)):
            for lean in (0, direction):
                end = post + lean
                offset = post - across_0 - lean * near
                if 0 <= end < width and t != lean:
                    along = offset / (t - lean)
                    if 0.0 < along <= far:
                        share = (along - near) / (far - near)
                        height = lines[before, post] + (lines[first, end] - lines[before, post]) * share
                        slope = (height - altitude) / along - (drop_along + drop_across * t * t) * along
                        if slope > steepest[q]:
                            steepest[q] = np.float32(slope)
    steepest[task[6]] = steepest[task[6] - 1]


@scalar_kernel
def _sweep_rows(heights, out, task, real, steepest, rays):
    width = heights.shape[1]
    before = np.full(width, np.float32(np.nan))
    for i in range(task[4]):
        index = task[3] + task[2] * i
        _line(task, real, index, width, (heights[index], before, 0), out[index], steepest, rays)
        before = heights[index]


@scalar_kernel
def _sweep_columns(heights, out, task, real, steepest, rays):
    rows = heights.shape[0]
    across_0, t_0, dt = real[1], real[3], real[4]
    t_first = t_0 + task[5] * dt
    t_last = t_first + (task[6] - 1) * dt
    direction, steps = task[2], task[4]
    ground = np.zeros((TILE + 1, rows), np.float32)
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
            ground[TILE, row - top] = heights[row, index - direction] if i > 0 else np.float32(np.nan)
        for k in range(n):
            line = k if direction > 0 else n - 1 - k
            before = TILE if k == 0 else line - direction
            start[line], stop[line] = _line(
                task, real, west + line, rows, (ground[line], ground[before], top), answer[line], steepest, rays
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
        nothing = np.full(1, np.float32(np.nan))
        steepest = np.zeros(BLOCK_RAYS + 2, np.float32)
        bend = np.zeros(BLOCK_RAYS + 2, np.float32)
        per_lean = np.zeros(BLOCK_RAYS + 2, np.float32)
        per_across = np.zeros(BLOCK_RAYS + 2, np.float32)
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
                    across = t * task[2]
                    per_lean[q] = 1.0 / (1.0 - across) if across < 1.0 else 1e30
                    per_across[q] = 1.0 / across if across > 0.0 else 0.0
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
                _first_strip(heights if task[1] == 0 else heights.T, task, real, steepest)
                if task[1] == 0:
                    _sweep_rows(heights, out[task[0]], task, real, steepest, (bend, per_lean, per_across, nothing))
                else:
                    _sweep_columns(heights, out[task[0]], task, real, steepest, (bend, per_lean, per_across, nothing))
