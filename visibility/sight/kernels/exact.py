"""Exact sweep: the horizon is carried outward over every edge of the triangulated surface, line of posts by line.

Between two lines of posts lie the straight edges (post to same post) and the diagonals; then come the edges of the
line itself. Each set is one pass of ``horizon.merge``, over those of its edges that may rise above the horizon
(``exact_lines``); a post's answer is the horizon at its bearing before its own line is added. The horizon of a block of
bearings has about as many pieces as the block has posts on the line, so the whole costs O(N) in practice.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import int32, int64, prange

from compiled.options import parallel_kernel, scalar_kernel
from compiled.vectors import BLOCK
from visibility.sight.kernels.blocks import block_of, owned_posts
from visibility.sight.kernels.exact_lines import DIAGONAL, ON_LINE, STRAIGHT, answer, mark, new_view, slopes, spread
from visibility.sight.kernels.horizon import Pieces, merge, new_horizon, start_over
from visibility.sight.kernels.turning import TILE, turn_out

__all__ = ["BLOCK_POSTS", "sweep"]

BLOCK_POSTS = 256
MARGIN = 1e-9  # bearings: neighbouring blocks overlap by this much
RADIAL = 1e-12  # of the distance: an edge that runs towards the eye shows as a point, which its posts already cover
POINT = 1e-14  # bearings: as wide as a post is that has no edge beside it
WORD = 2  # marks that are looked at together


class Strip(NamedTuple):
    """Two lines of posts that follow each other, and how far along each is; the nearer may lie at or behind the eye."""

    near: Any
    far: Any
    near_along: float
    far_along: float


@scalar_kernel
def _lowered(ground, post, along, block):
    """Height of a post, lowered by curvature, over the plane through the eye that slopes are counted from."""
    across = post - block.across_0
    lowered = float(ground[post]) - block.drop_along_m * along * along - block.drop_across_m * across * across
    return lowered - (block.altitude_m - block.tilt_m * along)


@scalar_kernel
def _add(pieces, count, bearing_a, bearing_b, p, q, limits):
    """Append the piece p + q·t between two bearings, in either order, cut to the block's limits (lowest, highest)."""
    lowest, highest = limits
    low = max(min(bearing_a, bearing_b), lowest)
    high = min(max(bearing_a, bearing_b), highest)
    if low < high and not math.isnan(p + q):
        pieces.start[count] = low
        pieces.stop[count] = high
        pieces.p[count] = p
        pieces.q[count] = q
        return count + 1
    return count


@scalar_kernel
def _edge_on_line(pieces, count, strip, post, block, limits):
    """Append the edge of the farther line from a post to the next."""
    along = strip.far_along
    if not 0 <= post < strip.far.shape[0] - 1:
        return count
    across = post - block.across_0
    height = _lowered(strip.far, post, along, block)
    next_height = _lowered(strip.far, post + 1, along, block)
    if math.isnan(height) != math.isnan(next_height):
        # unknown beyond: the known end is in the way of lines that run straight over it
        if math.isnan(height):
            bearing = (across + 1.0) / along
            return _add(pieces, count, bearing - POINT, bearing, next_height / along, 0.0, limits)
        return _add(pieces, count, across / along, across / along + POINT, height / along, 0.0, limits)
    rise = next_height - height
    p = (height - rise * across) / along
    return _add(pieces, count, across / along, (across + 1.0) / along, p, rise, limits)


@scalar_kernel
def _edge_of_strip(pieces, count, strip, post, lean, block, limits):
    """Append the edge from a post of the nearer line to post + lean of the farther one."""
    width = strip.far.shape[0]
    if not (0 <= post < width and 0 <= post + lean < width):
        return count
    near_along, far_along = strip.near_along, strip.far_along
    across = post - block.across_0
    # the edge is across = offset + lean * w; its bearing offset / w + lean
    offset = across - lean * near_along
    if abs(offset) < RADIAL * (1.0 + far_along):
        return count
    height = _lowered(strip.near, post, near_along, block)
    rise = _lowered(strip.far, post + lean, far_along, block) - height  # over one line, whatever far - near rounds to
    steep = (height - rise * near_along) / offset
    near_bearing = across / near_along if near_along > 0.0 else math.copysign(math.inf, offset)
    far_bearing = (across + lean) / far_along
    return _add(pieces, count, near_bearing, far_bearing, rise - steep * lean, steep, limits)


@scalar_kernel
def _marked_edges(pieces, strip, marks, run, kind, block, limits):
    """The edges of one kind that are marked, in order of bearing, as pieces; returns how many.

    run: (first post, how many, every which of them, the one of those to begin with); marks: two of them as one.
    """
    first, count, stride, odd = run
    lean = block.direction if kind == DIAGONAL else 0
    found = 0
    for word in range((count + 1) // WORD):
        if marks[word] == 0:
            continue
        for v in range(WORD * word, WORD * word + WORD):
            mark = (marks[word] >> (32 * (v - WORD * word))) & kind
            if mark == 0 or (stride == 2 and (first + v) & 1 != odd):
                continue
            if kind == ON_LINE:
                found = _edge_on_line(pieces, found, strip, first + v, block, limits)
            else:
                found = _edge_of_strip(pieces, found, strip, first + v, lean, block, limits)
    return found


@scalar_kernel
def _grown(horizon, size):
    """A horizon with room for at least size, content kept."""
    n = horizon.start.shape[0]
    if n >= size:
        return horizon
    larger = new_horizon(2 * size)
    larger.start[:n], larger.p[:n], larger.q[:n] = horizon.start, horizon.p, horizon.q
    return larger


@scalar_kernel
def _span(across_0, limits, near_along, far_along, width):
    """Posts [first, last] whose edges between two lines can lie within the block's bearings, one to spare."""
    lowest, highest = limits
    first = math.floor(across_0 + min(lowest * near_along, lowest * far_along)) - 1
    last = math.ceil(across_0 + max(highest * near_along, highest * far_along)) + 1
    return max(int(first), 0), min(int(last), width - 1)


@scalar_kernel
def _eye(block, along):
    """(level, across of post 0 from it, drop along, drop per square across) at one line."""
    level = block.altitude_m - block.tilt_m * along
    return level, -block.across_0, block.drop_along_m * along * along, block.drop_across_m


@scalar_kernel
def _carry(lines, out, block, room):
    """Carry one block's horizon over all lines of its sector.

    lines: (lines, posts) float32, the grid or, where sectors run over columns, its transpose; out: (rows, cols) of the
    grid. room: of ``_new_room``.
    """
    horizon, spare, pieces, view, tile = room
    along_0, across_0, t_0, dt = block.along_0, block.across_0, block.t_0, block.dt
    width = lines.shape[1]
    direction = block.direction
    lowest = max(t_0 + block.first_ray * dt, -1.0) - MARGIN
    highest = min(t_0 + (block.first_ray + block.rays - 1) * dt, 1.0) + MARGIN
    limits = (lowest, highest)
    answered, start, stop, whole = tile
    marks = view.marks.view(np.int64)
    n = start_over(horizon, lowest, highest)
    west, tile_lines, in_tile, top = 0, 0, 0, 0
    for i in range(block.lines):
        index = block.first_line + direction * i
        far = lines[index]
        along = abs(index - along_0)
        before = index - direction
        # signed: in the first strip the nearer line lies at or behind the eye
        near_along = (before - along_0) * direction
        has_near = 0 <= before < lines.shape[0]
        strip = Strip(lines[before] if has_near else far, far, near_along, along)
        first, last = _span(across_0, limits, max(near_along, 0.0), along, width)
        if block.axis == 1 and in_tile == 0:
            tile_lines = min(index % TILE + 1 if direction < 0 else TILE - index % TILE, block.lines - i)
            in_tile = tile_lines
            west = index if direction > 0 else index - tile_lines + 1
            farther = along + tile_lines
            top = max(math.floor(across_0 + min(lowest * along, lowest * farther)) - 1, 0)
        owned_from, owned_to = owned_posts(block, along, width)
        if last >= first:
            # one more on either side, to look at
            first, count = first - 1, last - first + 3
            level, from_0, drop_along, drop_across = _eye(block, along)
            slopes(far, (first, count), (level, from_0, drop_along, drop_across, 1.0 / along), view.far)
            spread(horizon, n, view, (first, count), (across_0, along))
            some = int64(STRAIGHT | DIAGONAL | ON_LINE)
            if has_near and near_along > 0.5:
                level_near, _, drop_near, _ = _eye(block, near_along)
                eye_near = (level_near, from_0, drop_near, drop_across, 1.0 / near_along)
                slopes(strip.near, (first, count), eye_near, view.near)
                some = mark(view, count, (first - across_0, 1.0 / near_along, 1.0 / along), direction)
            else:
                view.marks[:count] = int32(some)
            view.marks[0] = 0
            view.marks[count - 1 : count + WORD] = 0
            changed = False
            if has_near and some & (STRAIGHT | DIAGONAL) != 0:
                # diagonals that lean away from the axis overlap their neighbour's bearings, hence every other one
                for kind, stride, odd in ((STRAIGHT, 1, 0), (DIAGONAL, 2, 0), (DIAGONAL, 2, 1)):
                    found = _marked_edges(pieces, strip, marks, (first, count, stride, odd), kind, block, limits)
                    if found > 0:
                        changed = True
                        spare = _grown(spare, 2 * n + 4 * found + 8)
                        n = merge(horizon, n, pieces, found, spare)
                        horizon, spare = spare, horizon
            if changed:
                spread(horizon, n, view, (first, count), (across_0, along))
            if owned_to > owned_from:
                eye = (level, from_0, drop_along, drop_across, along)
                if block.axis == 0:
                    answer(far, view, (owned_from, owned_to, first, owned_from), eye, out[index])
                else:
                    answer(far, view, (owned_from, owned_to, first, owned_from - top), eye, answered[index - west])
            if some & ON_LINE != 0:
                found = _marked_edges(pieces, strip, marks, (first, count, 1, 0), ON_LINE, block, limits)
                if found > 0:
                    spare = _grown(spare, 2 * n + 4 * found + 8)
                    n = merge(horizon, n, pieces, found, spare)
                    horizon, spare = spare, horizon
        if block.axis == 1:
            start[index - west], stop[index - west] = owned_from, max(owned_to, owned_from)
            in_tile -= 1
            if in_tile == 0:
                _turn_out(answered, (top, west, tile_lines), start, stop, whole, out)


@scalar_kernel
def _turn_out(answered, where, start, stop, whole, out):
    """Copy what a tile of lines owns into the grid, whose columns they are.

    where: (first row of the lines, first column, columns).
    """
    top, west, n = where
    for group in range(len(whole)):
        some = slice(group * BLOCK, group * BLOCK + BLOCK)
        # fewer lines are not turned as a block
        whole[group] = (start[some].max(), stop[some].min()) if some.stop <= n else (0, 0)
    first, last = out.shape[0], 0
    for k in range(n):
        if stop[k] > start[k]:
            first, last = min(first, start[k]), max(last, stop[k])
    turn_out(answered, (top, first, last, west, n), start, stop, whole, out)


@scalar_kernel
def _new_room(block):
    """What ``_carry`` works in: two horizons, pieces, a view of a line, and a tile of answers."""
    # posts that a line can have within the block's bearings
    length = abs(block.first_line + block.direction * (block.lines - 1) - block.along_0)
    posts = int(length * block.dt * (block.rays - 1)) + 32
    pieces = Pieces(np.zeros(posts), np.zeros(posts), np.zeros(posts), np.zeros(posts))
    tile = (
        np.zeros((TILE, posts + TILE + BLOCK), np.float32),
        np.zeros(TILE, np.int64),
        np.zeros(TILE, np.int64),
        np.zeros((TILE // BLOCK, 2), np.int64),
    )
    return new_horizon(8 * posts), new_horizon(8 * posts), pieces, new_view((posts // WORD + 2) * WORD), tile


@parallel_kernel
def sweep(heights, turned, out, blocks, bins):
    """Fill out (n_anchors, rows, cols) with the altitude that clears every edge on the way to each anchor.

    heights: (rows, cols) float32, at least 2 x 2; turned: its contiguous transpose; NaN posts have no edges, and
    a post beside one still hides what is straight behind it.
    blocks, bins: as for the fast sweep (kernels.sweep), with blocks of bearings in place of blocks of rays.
    """
    for worker in prange(bins.shape[0]):
        for slot in range(bins.shape[1]):
            number = bins[worker, slot]
            if number >= 0:
                block = block_of(blocks, number)
                room = _new_room(block)
                _carry(heights if block.axis == 0 else turned, out[block.eye], block, room)
