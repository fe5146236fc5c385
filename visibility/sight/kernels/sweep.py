"""The column-wise O(N) sweep: independent rays, one running maximum each (De Vivo, Battipede, Gili, II-B, eqs. 10-11).

Rays fan out from the eye in four sectors, |across| <= |along| in post units. Along a sector the rays cross one row (or
column) of posts after the other; each keeps the steepest slope it has met, in metres per step along, and a post's
answer is interpolated between its two neighbouring rays. Near the eye few rays run; whenever they have spread by half a
post their number doubles, until at the far end they are one post apart. Sectors east and west run over columns; they
turn small tiles on the way, so that both kinds of sector read and write the grid along its rows and each cache line
travels once.
"""

import math

import numpy as np
from numba import float32, int64, prange

from compiled.options import parallel_kernel, scalar_kernel
from compiled.vectors import BLOCK
from visibility.sight.kernels.owned_posts import owned_posts
from visibility.sight.kernels.sweep_edges import cross_strip, enter, first_strip, rays_on_map
from visibility.sight.kernels.sweep_loops import NO_GROUND, NOT_BLOCKED, STRIDE, advance, answer
from visibility.sight.kernels.turning import TILE, turn_in, turn_out

__all__ = ["BLOCK_RAYS", "COARSEST", "REAL_COLUMNS", "TASK_COLUMNS", "sweep"]

BLOCK_RAYS = 2048
COARSEST = 16  # near the eye only every 16th ray runs, or fewer are left out
WIDEST_GAP = 0.5  # posts between neighbouring rays, as long as there are rays left to start
NEAR_LINES = 16  # so far rays take in every edge: what one of them misses there, all posts behind it miss
LINES_AHEAD = 3
RAY_ROOM = 2 * BLOCK_RAYS + 2 * STRIDE  # a block has at most twice its rays; vectors reach over the last
TILE_ROOM = 2 * BLOCK_RAYS + 3 * TILE + 8  # rows a tile can span; no power of two, or its lines would share cache sets

# one task = one block of rays in one sector of one eye
TASK_COLUMNS = (
    "eye", "axis", "direction", "first", "steps",
    "first_ray", "rays", "is_first_block", "is_last_block", "is_eye_inside", "coarsest",
)  # fmt: skip
REAL_COLUMNS = ("along_0", "across_0", "altitude_m", "t_0", "dt", "drop_along", "drop_across", "tilt")


@scalar_kernel
def _load_rays(task, real, stride, fan):
    """Per-ray numbers: bend (curvature), and how far back a ray meets a diagonal or a straight edge per post across."""
    for q in range((task[6] - 1) // stride + 1):
        t = real[3] + (task[5] + q * stride) * real[4]
        fan[0, q] = real[5] + real[6] * t * t
        leaning = t * task[2]
        fan[1, q] = 1.0 / (1.0 - leaning) if leaning < 1.0 else 1e30
        fan[2, q] = 1.0 / leaning if leaning > 0.0 else 0.0


@scalar_kernel
def _first_stride(task, real):
    """Every how many rays run at first: fewer are left out where the sector is short."""
    near = max(abs(task[3] - real[0]), 1.0)
    stride = task[10]
    while stride > 1 and near * real[4] * stride > WIDEST_GAP:
        stride //= 2
    return stride


@scalar_kernel
def _refine(along, task, real, stride, state, width):
    """Double the rays until they are close enough together at this distance; returns the new stride."""
    steepest, fan = state[0], state[1]
    left_end, right_end = rays_on_map(real[1], width)
    while stride > 1 and along * real[4] * stride > WIDEST_GAP:
        count = (task[6] - 1) // stride + 1
        for q in range(count - 1, 0, -1):
            left, right = steepest[q - 1], steepest[q]
            steepest[2 * q] = right
            if left > NO_GROUND and right > NO_GROUND:
                between = float32(0.5) * (left + right)
            else:
                # only one of them has come onto the map: so has the one between them, or not yet
                t = real[3] + (task[5] + (q - 0.5) * stride) * real[4]
                across = real[1] + t * (along - 1.0)
                between = max(left, right) if left_end <= across <= right_end else NO_GROUND
            steepest[2 * q - 1] = between
        steepest[2 * count - 1] = steepest[2 * count - 2]
        stride //= 2
        _load_rays(task, real, stride, fan)
    return stride


@scalar_kernel
def _answer_line(owned, real, scale, eye, lines, out, state):
    """Answer the owned posts of a line; the outermost post of the map has no neighbour aside on one side."""
    q_first, dq, count, width, lean, is_eye_inside = scale
    steepest, _, places, picked = state
    ground, before, ground_start, ahead = lines
    start, stop = owned
    if stop <= start:
        return
    inner_start = max(start, 1) if lean < 0 else start
    inner_stop = min(stop, width - 1) if lean > 0 else stop
    drop_along = float32(real[5] * float(eye[1]) * float(eye[1]))
    seen_from = (*eye, drop_along, float32(real[6]), float32(lean), is_eye_inside)
    for piece in range(3):
        first, last, aside = inner_start, inner_stop, lean
        if piece == 1:
            first, last, aside = start, inner_start, 0
        elif piece == 2:
            first, last, aside = inner_stop, stop, 0
        if last > first:
            q = float32(max((first - real[1]) * dq - q_first, 0.0))
            where = (
                first - ground_start,
                last - first,
                aside,
                count - 1,
                q,
                float32(dq),
                float32(first - real[1]),
                first,
            )
            answer(out, ground, before, ahead, steepest, places, picked, where, seen_from)
    # from beyond a border that runs along the sector, a line reaches the posts on it from outside: nothing is between
    if start == 0 and real[1] < 0.0:
        out[-ground_start] = ground[-ground_start]
    if stop == width and real[1] > width - 1:
        out[width - 1 - ground_start] = ground[width - 1 - ground_start]


@scalar_kernel
def _line(task, real, index, stride, lines, out, state):
    """Answer the owned posts of one line, then let its edges raise the rays; returns (start, stop) of the owned.

    lines: (heights of this line, of the one before it, their first post, posts on a whole line); out starts like lines.
    Slopes are counted from a plane through the eye that falls by ``tilt`` metres per line, so that float32 serves for
    eyes as far as satellites; ``level`` is its altitude on this line.
    """
    ground, before, ground_start, width, ahead = lines
    steepest, fan, places, picked = state
    along = abs(index - real[0])
    lean = task[2]
    count = (task[6] - 1) // stride + 1
    t_first = real[3] + task[5] * real[4]
    spacing = real[4] * stride * along
    eye = (float32(real[2] - real[7] * along), float32(along), float32(1.0 / along), float32(real[7]))
    owned = owned_posts(task, real, along, width)
    scale = (t_first / (real[4] * stride), 1.0 / spacing, count, width, lean, task[9] == 1)
    _answer_line(owned, real, scale, eye, (ground, before, ground_start, ahead), out, state)

    across = real[1] + t_first * along
    q_from, q_to = 0, count
    left, right = rays_on_map(real[1], width)
    if across < left:
        q_from = math.ceil((left - across) / spacing)
    if across + (count - 1) * spacing > right:
        q_to = math.floor((right - across) / spacing) + 1
    if q_to > q_from:
        across += q_from * spacing
        base = min(max(math.floor(across), 0), width - 2)
        where = (
            q_from,
            q_to - q_from,
            q_to < count,
            base - ground_start,
            width - 2 - base,
            float32(across - base),
            float32(spacing),
            lean,
        )
        advance(steepest, fan, ground, before, places, picked, where, eye)
        if along <= NEAR_LINES and abs(task[3] - real[0]) < along - 0.5:
            cross_strip(task, real, along, stride, (ground, before, ground_start, width), (q_from, q_to), steepest)
        if real[1] < 0.0 or real[1] > width - 1:
            enter(task, real, along, stride, (ground, before, ground_start, width), (q_from, q_to), steepest)
        steepest[count] = steepest[count - 1]
    return owned


@scalar_kernel
def _row_ahead(index, direction, rows):
    ahead = index + LINES_AHEAD * direction
    return ahead if 0 <= ahead < rows else -1


@scalar_kernel
def _sweep_rows(heights, blank, out, task, real, stride, state):
    width = heights.shape[1]
    before = blank
    for i in range(task[4]):
        index = task[3] + task[2] * i
        stride = _refine(abs(index - real[0]), task, real, stride, state, width)
        row_ahead = _row_ahead(index, task[2], heights.shape[0])
        ahead = (heights, row_ahead, out, row_ahead)
        _line(task, real, index, stride, (heights[index], before, int64(0), width, ahead), out[index], state)
        before = heights[index]


@scalar_kernel
def _sweep_columns(heights, turned, blank, out, task, real, stride, state, tile, shift):
    rows = heights.shape[0]
    is_turned = turned.shape[0] > 0
    across_0, t_0, dt = real[1], real[3], real[4]
    t_first = t_0 + task[5] * dt
    t_last = t_first + (task[6] - 1) * dt
    direction, steps = task[2], task[4]
    ground, answered = tile
    ground[TILE] = np.nan  # the line before the tile
    start = np.zeros(TILE, np.int64)
    stop = np.zeros(TILE, np.int64)
    whole = np.zeros((TILE // BLOCK, 2), np.int64)
    i, top, bottom, farthest = 0, 0, 0, 0
    while i < steps:
        past_top, past_bottom = top, bottom
        index = task[3] + direction * i
        # a tile ends where a cache line of the grid does
        beyond = (index + shift) % TILE
        n = beyond + 1 if direction < 0 else TILE - beyond
        n = min(n, steps - i)
        west = index if direction > 0 else index - n + 1
        near = abs(index - real[0])
        far = abs(index + direction * (n - 1) - real[0])
        top = math.floor(across_0 + min(t_first * near, t_first * far)) - 1
        bottom = math.ceil(across_0 + max(t_last * near, t_last * far)) + 2
        top = min(max(top, 0), rows - 2)
        bottom = max(min(bottom, rows - 1), top + 1)
        if not is_turned:
            # the line before is the last one of the tile before, as far as the rays of this tile can have come from
            shared = slice(max(top, past_top), max(min(bottom, past_bottom) + 1, top))
            if i > 0:
                ground[TILE, : bottom + 1 - top] = np.nan
                ground[TILE, shared.start - top : shared.stop - top] = ground[
                    farthest, shared.start - past_top : shared.stop - past_top
                ]
            turn_in(heights, (top, bottom + 1, west, n), ground)
        for k in range(n):
            line = k if direction > 0 else n - 1 - k
            stride = _refine(abs(west + line - real[0]), task, real, stride, state, rows)
            here, before = ground[line], ground[TILE if k == 0 else line - direction]
            ahead = (turned, _row_ahead(west + line, direction, turned.shape[0]), out, int64(-1))
            if is_turned:
                here = turned[west + line, top:]
                before = turned[west + line - direction, top:] if i + k > 0 else blank
            lines = (here, before, top, rows, ahead)
            start[line], stop[line] = _line(task, real, west + line, stride, lines, answered[line], state)
        farthest = n - 1 if direction > 0 else 0
        for group in range(len(whole)):
            some = slice(group * BLOCK, group * BLOCK + BLOCK)
            # fewer lines are not turned as a block
            whole[group] = (start[some].max(), stop[some].min()) if some.stop <= n else (0, 0)
        turn_out(answered, (top, start[:n].min(), stop[:n].max(), west, n), start, stop, whole, out)
        i += n


@parallel_kernel
def sweep(heights, turned, blank, out, tasks, reals, bins, shift):
    """Fill out (n_eyes, rows, cols) with the altitude that clears the ground on the way to each eye.

    heights: (rows, cols) float32, at least 2 x 2; NaN posts block nothing.
    turned: the same (cols, rows), which serves many eyes at once; or (0, 0): tiles are turned on the way.
    blank: NaN, as many as a line has posts: the line before the first.
    tasks, reals: one row per block of rays, columns TASK_COLUMNS and REAL_COLUMNS, rays - 1 a multiple of COARSEST;
        drop_along and drop_across are curvature drops in metres per square step.
    bins: (workers, most) int64, the tasks of each worker, -1 = none.
    shift: float32 between the start of a cache line and that of out; tiles end where cache lines do.
    """
    for worker in prange(bins.shape[0]):
        steepest = np.zeros(RAY_ROOM, np.float32)
        fan = np.zeros((3, RAY_ROOM), np.float32)
        state = (steepest, fan, np.zeros(STRIDE, np.int32), np.zeros((3, STRIDE), np.float32))
        room = min(TILE_ROOM, heights.shape[0] + 3 * TILE + 8)
        tile = (np.empty((TILE + 1, room), np.float32), np.empty((TILE, room), np.float32))
        for slot in range(bins.shape[1]):
            number = bins[worker, slot]
            if number >= 0:
                task = tasks[number]
                row = reals[number]
                real = (row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7])
                steepest[:] = NOT_BLOCKED if task[9] == 1 else NO_GROUND
                stride = _first_stride(task, real)
                _load_rays(task, real, stride, state[1])
                if task[1] == 0:
                    first_strip(heights, task, real, stride, steepest)
                    _sweep_rows(heights, blank, out[task[0]], task, real, stride, state)
                else:
                    first_strip(heights.T, task, real, stride, steepest)
                    _sweep_columns(heights, turned, blank, out[task[0]], task, real, stride, state, tile, shift)
