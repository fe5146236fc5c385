"""Exact sweep: the horizon is carried outward over every edge of the triangulated surface, line of posts by line.

Between two lines of posts lie the straight edges (post to same post) and the diagonals; then come the edges of the
line itself. Each set is one pass of ``horizon.merge``; a post's answer is the horizon at its bearing before its own
line is added. The horizon of a block of bearings has about as many pieces as the block has posts on the line, so the
whole costs O(N) in practice.
"""

import math

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel
from visibility.sight.kernels.blocks import block_of, owned_posts
from visibility.sight.kernels.horizon import Pieces, height_over, merge, new_horizon, start_over

__all__ = ["BLOCK_POSTS", "sweep"]

BLOCK_POSTS = 256
GRAZING_TOLERANCE_M = 1e-5
MARGIN = 1e-9  # bearings: neighbouring blocks overlap by this much
RADIAL = 1e-12  # of the distance: an edge that runs towards the eye shows as a point, which its posts already cover


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
def _line_pieces(ground, along, posts, block, limits, pieces):
    """Edges of one line of posts, between neighbouring posts of (first, last)."""
    first, last = posts
    count = 0
    if last <= first:
        return 0
    height = _lowered(ground, first, along, block)
    for post in range(first, last):
        across = post - block.across_0
        following = _lowered(ground, post + 1, along, block)
        rise = following - height
        p = (height - rise * across) / along
        count = _add(pieces, count, across / along, (across + 1.0) / along, p, rise, limits)
        height = following
    return count


@scalar_kernel
def _strip_pieces(near, far, along, lean, posts, block, limits, pieces):
    """Edges from a line of posts to the next, farther one, from post to post + lean.

    along: of the two lines; the nearer may lie at or behind the eye. posts: (first, last, stride) on the nearer line.
    """
    count = 0
    near_along, far_along = along
    width = near.shape[0]
    first, last, stride = posts
    for post in range(first, last + 1, stride):
        if not 0 <= post + lean < width:
            continue
        across = post - block.across_0
        # the edge is across = offset + lean * w; its bearing offset / w + lean
        offset = across - lean * near_along
        if abs(offset) < RADIAL * (1.0 + far_along):
            continue
        height = _lowered(near, post, near_along, block)
        rise = _lowered(far, post + lean, far_along, block) - height  # over one line, whatever far - near rounds to
        steep = (height - rise * near_along) / offset
        near_bearing = across / near_along if near_along > 0.0 else math.copysign(math.inf, offset)
        far_bearing = (across + lean) / far_along
        count = _add(pieces, count, near_bearing, far_bearing, rise - steep * lean, steep, limits)
    return count


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
def _carry(lines, out, block, horizon, spare, pieces):
    """Carry one block's horizon over all lines of its sector; out is the answer, turned like lines."""
    along_0, across_0, t_0, dt = block.along_0, block.across_0, block.t_0, block.dt
    width = lines.shape[1]
    direction = block.direction
    lowest = max(t_0 + block.first_ray * dt, -1.0) - MARGIN
    highest = min(t_0 + (block.first_ray + block.rays - 1) * dt, 1.0) + MARGIN
    limits = (lowest, highest)
    n = start_over(horizon, lowest, highest)
    for i in range(block.lines):
        index = block.first_line + direction * i
        far = lines[index]
        along = abs(index - along_0)
        before = index - direction
        if 0 <= before < lines.shape[0]:
            near = lines[before]
            # signed: in the first strip the nearer line lies at or behind the eye
            near_along = (before - along_0) * direction
            first, last = _span(across_0, limits, max(near_along, 0.0), along, width)
            # diagonals that lean away from the axis overlap their neighbour's bearings, hence every other one
            for lean, offset, stride in ((0, 0, 1), (direction, 0, 2), (direction, 1, 2)):
                posts = (first + offset, last, stride)
                count = _strip_pieces(near, far, (near_along, along), lean, posts, block, limits, pieces)
                if count > 0:
                    spare = _grown(spare, 2 * n + 4 * count + 8)
                    n = merge(horizon, n, pieces, count, spare)
                    horizon, spare = spare, horizon
        start, stop = owned_posts(block, along, width)
        k = 0
        for post in range(start, stop):
            across = post - across_0
            slope, rounding, k = height_over(horizon, n, k, across / along)
            own = float(far[post])
            drop = block.drop_along_m * along * along + block.drop_across_m * across * across
            clear = (block.altitude_m - block.tilt_m * along) + slope * along + drop
            out[index, post] = own if clear <= own + GRAZING_TOLERANCE_M + rounding * along else clear
        first, last = _span(across_0, limits, along, along, width)
        count = _line_pieces(far, along, (first, last), block, limits, pieces)
        if count > 0:
            spare = _grown(spare, 2 * n + 4 * count + 8)
            n = merge(horizon, n, pieces, count, spare)
            horizon, spare = spare, horizon


@parallel_kernel
def sweep(heights, turned, out, blocks, bins):
    """Fill out (n_anchors, rows, cols) with the altitude that clears every edge on the way to each anchor.

    heights: (rows, cols) float32, at least 2 x 2; turned: its contiguous transpose; NaN posts have no edges.
    blocks, bins: as for the fast sweep (kernels.sweep), with blocks of bearings in place of blocks of rays.
    """
    for worker in prange(bins.shape[0]):
        room = 8 * BLOCK_POSTS
        horizon, spare = new_horizon(room), new_horizon(room)
        pieces = Pieces(np.zeros(room), np.zeros(room), np.zeros(room), np.zeros(room))
        for slot in range(bins.shape[1]):
            number = bins[worker, slot]
            if number >= 0:
                block = block_of(blocks, number)
                if block.axis == 0:
                    _carry(heights, out[block.eye], block, horizon, spare, pieces)
                else:
                    _carry(turned, out[block.eye].T, block, horizon, spare, pieces)
