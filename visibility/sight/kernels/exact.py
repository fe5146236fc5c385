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
from visibility.sight.kernels.horizon import height_over, merge
from visibility.sight.kernels.owned_posts import owned_posts

__all__ = ["BLOCK_POSTS", "sweep"]

BLOCK_POSTS = 256
GRAZING_TOLERANCE_M = 1e-5
MARGIN = 1e-9  # bearings: neighbouring blocks overlap by this much
RADIAL = 1e-12  # of the distance: an edge that runs towards the eye shows as a point, which its posts already cover


@scalar_kernel
def _lowered(ground, post, along, real):
    """Height of a post, lowered by curvature, over the plane through the eye that slopes are counted from."""
    across = post - real[1]
    return float(ground[post]) - real[5] * along * along - real[6] * across * across - (real[2] - real[7] * along)


@scalar_kernel
def _add(pieces, count, bearing_a, bearing_b, line, limits):
    """Append the piece between two bearings, in either order, cut to the block's limits."""
    low = max(min(bearing_a, bearing_b), limits[0])
    high = min(max(bearing_a, bearing_b), limits[1])
    if low < high and not math.isnan(line[0] + line[1]):
        pieces[0][count] = low
        pieces[1][count] = high
        pieces[2][count] = line[0]
        pieces[3][count] = line[1]
        return count + 1
    return count


@scalar_kernel
def _line_pieces(ground, along, posts, real, limits, pieces):
    """Edges of one line of posts, between neighbouring posts."""
    count = 0
    if posts[1] <= posts[0]:
        return 0
    height = _lowered(ground, posts[0], along, real)
    for post in range(posts[0], posts[1]):
        across = post - real[1]
        following = _lowered(ground, post + 1, along, real)
        rise = following - height
        line = ((height - rise * across) / along, rise)
        count = _add(pieces, count, across / along, (across + 1.0) / along, line, limits)
        height = following
    return count


@scalar_kernel
def _strip_pieces(near, far, along, lean, posts, real, limits, pieces):
    """Edges from a line of posts to the next, farther one, from post to post + lean.

    along: of the two lines; the nearer may lie at or behind the eye. posts: (first, last, stride) on the nearer line.
    """
    count = 0
    near_along, far_along = along
    width = near.shape[0]
    for post in range(posts[0], posts[1] + 1, posts[2]):
        if not 0 <= post + lean < width:
            continue
        across = post - real[1]
        # the edge is across = offset + lean * w; its bearing offset / w + lean
        offset = across - lean * near_along
        if abs(offset) < RADIAL * (1.0 + far_along):
            continue
        height = _lowered(near, post, near_along, real)
        rise = _lowered(far, post + lean, far_along, real) - height  # over one line, whatever far - near rounds to
        steep = (height - rise * near_along) / offset
        near_bearing = across / near_along if near_along > 0.0 else math.copysign(math.inf, offset)
        far_bearing = (across + lean) / far_along
        count = _add(pieces, count, near_bearing, far_bearing, (rise - steep * lean, steep), limits)
    return count


@scalar_kernel
def _grown(arrays, size):
    """Three arrays with room for at least size, content kept."""
    if arrays[0].shape[0] >= size:
        return arrays
    room = 2 * size
    start, p, q = np.zeros(room), np.zeros(room), np.zeros(room)
    n = arrays[0].shape[0]
    start[:n], p[:n], q[:n] = arrays[0], arrays[1], arrays[2]
    return start, p, q


@scalar_kernel
def _span(across_0, limits, near_along, far_along, width):
    """Posts [first, last] whose edges between two lines can lie within the block's bearings, one to spare."""
    first = math.floor(across_0 + min(limits[0] * near_along, limits[0] * far_along)) - 1
    last = math.ceil(across_0 + max(limits[1] * near_along, limits[1] * far_along)) + 1
    return max(int(first), 0), min(int(last), width - 1)


@scalar_kernel
def _block(lines, out, task, real, horizon, spare, pieces):
    """Carry one block's horizon over all lines of its sector; out is the answer, turned like lines."""
    along_0, across_0, altitude, t_0, dt, drop_along, drop_across, tilt = real
    width = lines.shape[1]
    direction = task[2]
    limits = (
        max(t_0 + task[5] * dt, -1.0) - MARGIN,
        min(t_0 + (task[5] + task[6] - 1) * dt, 1.0) + MARGIN,
    )
    horizon[0][0], horizon[1][0], horizon[2][0], horizon[0][1] = limits[0], -math.inf, 0.0, limits[1]
    n = 1
    for i in range(task[4]):
        index = task[3] + direction * i
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
                count = _strip_pieces(near, far, (near_along, along), lean, posts, real, limits, pieces)
                if count > 0:
                    spare = _grown(spare, 2 * n + 4 * count + 8)
                    n = merge(horizon, n, pieces, count, spare)
                    horizon, spare = spare, horizon
        start, stop = owned_posts(task, real, along, width)
        k = 0
        for post in range(start, stop):
            across = post - across_0
            slope, rounding, k = height_over(horizon, n, k, across / along)
            own = float(far[post])
            drop = drop_along * along * along + drop_across * across * across
            clear = (altitude - tilt * along) + slope * along + drop
            out[index, post] = own if clear <= own + GRAZING_TOLERANCE_M + rounding * along else clear
        first, last = _span(across_0, limits, along, along, width)
        count = _line_pieces(far, along, (first, last), real, limits, pieces)
        if count > 0:
            spare = _grown(spare, 2 * n + 4 * count + 8)
            n = merge(horizon, n, pieces, count, spare)
            horizon, spare = spare, horizon


@parallel_kernel
def sweep(heights, turned, out, tasks, reals, bins):
    """Fill out (n_anchors, rows, cols) with the altitude that clears every edge on the way to each anchor.

    heights: (rows, cols) float32, at least 2 x 2; turned: its contiguous transpose; NaN posts have no edges.
    tasks, reals, bins: as for the fast sweep (kernels.sweep), with blocks of bearings in place of blocks of rays.
    """
    for worker in prange(bins.shape[0]):
        room = 8 * BLOCK_POSTS
        horizon = (np.zeros(room), np.zeros(room), np.zeros(room))
        spare = (np.zeros(room), np.zeros(room), np.zeros(room))
        pieces = (np.zeros(room), np.zeros(room), np.zeros(room), np.zeros(room))
        for slot in range(bins.shape[1]):
            number = bins[worker, slot]
            if number >= 0:
                task = tasks[number]
                row = reals[number]
                real = (row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7])
                if task[1] == 0:
                    _block(heights, out[task[0]], task, real, horizon, spare, pieces)
                else:
                    _block(turned, out[task[0]].T, task, real, horizon, spare, pieces)
