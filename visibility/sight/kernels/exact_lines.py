"""One line of posts in the exact sweep: the horizon over its posts, what can rise above it, and its answers.

Most edges show nowhere above the horizon. An edge is a straight piece in perspective, so where both its ends lie below
the lowest that the horizon is between them, all of it does; and an edge of a strip that faces the eye lies below the
farther line's own edges. Ends and horizon are looked at for many posts at once; what is left is merged piece by piece.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import float64, int32, int64, uint64

from compiled.options import inner_loop, scalar_kernel

__all__ = ["DIAGONAL", "ON_LINE", "STRAIGHT", "View", "answer", "mark", "new_view", "slopes", "spread"]

GRAZING_TOLERANCE_M = 1e-5
SAME_BEARING = 1e-15  # a few roundings of a bearing, which is at most 1
CHUNK = 64  # joints that are looked at together
SAME_PLACE = 1e-9  # posts: only joints that close to a post are looked at whether they have its bearing

# edges from a post: to the same post and to the next one aside on the farther line, to the next one on this line
STRAIGHT, DIAGONAL, ON_LINE = np.int32(1), np.int32(2), np.int32(4)


class View(NamedTuple):
    """A line's posts as a block sees them, from a first one on, which may lie beyond the map; (n,) float64 each.

    near, far: slopes of the same posts on the nearer line and on this one, -inf = unknown or beyond the map. p, q: the
    piece of the horizon at each post's bearing. dips: lowest joint of the horizon between the post before and a post.
    lowest: of the horizon from a post to the next. marks: (n,) int32, which edges from a post may rise above it.
    stops, lows: (CHUNK,) of some of the horizon's joints, the first post at or past each, and its lower side.
    """

    near: Any
    far: Any
    p: Any
    q: Any
    dips: Any
    lowest: Any
    marks: Any
    stops: Any
    lows: Any


@scalar_kernel
def new_view(room):
    """A View with room for so many posts."""
    return View(
        np.zeros(room), np.zeros(room), np.zeros(room), np.zeros(room), np.zeros(room), np.zeros(room),
        np.zeros(room, np.int32), np.zeros(CHUNK, np.int32), np.zeros(CHUNK),
    )  # fmt: skip


@inner_loop
def slopes(ground, run, eye, out):
    """Slopes of count posts into out, the first of which is post ``first``; run: (first, count).

    ground: (width,) float32. eye: (level, across of post 0, drop along, drop per square across, 1 / along).
    """
    first, count = run
    level, across_0, drop_along, drop_across, per_along = eye
    begin, end = max(-first, 0), min(count, ground.shape[0] - first)
    for v in range(begin):
        out[uint64(v)] = -math.inf
    for v in range(max(end, begin), count):
        out[uint64(v)] = -math.inf
    from_eye = float64(first) + across_0
    for v in range(begin, end):
        across = float64(int32(v)) + from_eye
        slope = (float64(ground[uint64(first + v)]) - drop_along - drop_across * across * across - level) * per_along
        out[uint64(v)] = slope if slope == slope else -math.inf


@inner_loop
def _joints(horizon, begin, m, run, eye, view):
    """Of joints begin + 1 … begin + m: the first post at or past each, its lower side; whether any is at a post."""
    start, p, q = horizon
    stops, lows = view.stops, view.lows
    first, count = run
    across_0, along = eye
    from_first = across_0 - first
    last = float64(count)
    tied = int64(0)
    for i in range(m):
        k, after = uint64(begin + i), uint64(begin + i + 1)
        bearing = start[after]
        place = min(max(from_first + bearing * along, -1.0), last)
        stop = math.ceil(place)
        stops[uint64(i)] = int32(max(stop, 0.0))
        lows[uint64(i)] = min(p[k] + q[k] * bearing, p[after] + q[after] * bearing)
        tied |= int64(stop - place < SAME_PLACE or place - (stop - 1.0) < SAME_PLACE)
    return tied


@scalar_kernel
def spread(horizon, n, view, run, eye):
    """Write the piece of the horizon at the bearing of each post, and the lowest joint from it to the next.

    A bearing that falls on the joint of two pieces takes the higher: the edges of both end there.
    run: (first post, how many); eye: (its place across, along).
    """
    p, q = horizon.p, horizon.q
    to_p, to_q, dips, stops, lows = view.p, view.q, view.dips, view.stops, view.lows
    _, count = run
    dips[: count + 1] = math.inf
    ties = 0
    v = 0
    for begin in range(0, n - 1, CHUNK):
        m = min(CHUNK, n - 1 - begin)
        ties |= _joints(horizon, begin, m, run, eye, view)
        for i in range(m):
            k, stop = begin + i, stops[i]
            # mostly one post or none: two are written, and what is not its own is overwritten
            to_p[v], to_q[v] = p[k], q[k]
            to_p[v + 1], to_q[v + 1] = p[k], q[k]
            for more in range(v + 2, stop):
                to_p[more], to_q[more] = p[k], q[k]
            dips[stop] = min(dips[stop], lows[i])
            v = stop
    for rest in range(v, count):
        to_p[rest], to_q[rest] = p[n - 1], q[n - 1]
    if ties:
        _settle_ties(horizon, n, view, run, eye)


@scalar_kernel
def _settle_ties(horizon, n, view, run, eye):
    """Give posts that have the bearing of joints the highest piece that ends there; joints count on either side."""
    start, p, q = horizon
    to_p, to_q, dips = view.p, view.q, view.dips
    first, count = run
    across_0, along = eye
    for k in range(n - 1):
        bearing = start[k + 1]
        place = across_0 - first + bearing * along
        post = math.floor(place + 0.5)
        if abs(place - post) < SAME_PLACE and 0 <= post < count:
            before, after = p[k] + q[k] * bearing, p[k + 1] + q[k + 1] * bearing
            for beside in range(post, post + 2):
                dips[beside] = min(dips[beside], min(before, after))
            is_same = abs(bearing - (post + first - across_0) / along) <= SAME_BEARING
            if is_same and max(before, after) > to_p[post] + to_q[post] * bearing:
                higher = k if before > after else k + 1
                to_p[post], to_q[post] = p[higher], q[higher]


@inner_loop
def mark(view, count, places, lean):
    """Mark which edges from each post, but the first and the last, may rise above the horizon; returns all that occur.

    places: (across of the first post from the eye, 1 / along of the nearer line, of this one).
    """
    near, far, p, q, dips, lowest, marks, _, _ = view
    across, per_near, per_far = places
    for i in range(count - 1):
        v, following = uint64(i), uint64(i + 1)
        bearing = (across + float64(int32(i))) * per_far
        here = p[v] + q[v] * bearing
        there = p[following] + q[following] * (bearing + per_far)
        lowest[v] = min(min(here, there), dips[following])
    some = int32(0)
    for i in range(count - 2):
        before, v, after = uint64(i), uint64(i + 1), uint64(i + 2)
        bearing = (across + float64(int32(i + 1))) * per_near
        size = abs(bearing)
        is_right = bearing >= 0.0
        near_here, here, to_left, to_right = near[v], far[v], far[before], far[after]
        low_left, low_right = lowest[before], lowest[v]
        # in posts of the farther line the nearer post lies outward of the same post on it, by its bearing
        outward = to_right if is_right else to_left
        aside = to_right if lean > 0 else to_left
        low_outward = low_right if is_right else low_left
        over_line = not near_here <= here + size * (outward - here)
        straight = over_line and max(near_here, here) > low_outward
        # a diagonal leans out beside the straight edge, or in past the post on the farther line
        leans_out = is_right == (lean > 0)
        over_post = not near_here * (1.0 + size) + (aside - near_here) * size <= here * (1.0 + size)
        floor = low_outward if leans_out else min(low_left, low_right)
        diagonal = (over_line or (over_post and not leans_out)) and max(near_here, aside) > floor
        on_line = max(here, to_right) > low_right
        found = int32(straight) * STRAIGHT + int32(diagonal) * DIAGONAL + int32(on_line) * ON_LINE
        marks[v] = found
        some |= found
    return int64(some)


@inner_loop
def answer(ground, view, posts, eye, out):
    """Altitudes that clear the horizon over posts [start, stop), into out from ``place`` on.

    posts: (start, stop, the first post of the view, place). eye: (level, across of post 0, drop along, drop per square
    across, along).
    """
    start, stop, first, place = posts
    level, across_0, drop_along, drop_across, along = eye
    p, q = view.p, view.q
    from_eye = float64(start) + across_0
    for i in range(stop - start):
        across = float64(int32(i)) + from_eye
        v = uint64(start - first + i)
        slope = p[v] + q[v] * (across / along)
        own = float64(ground[uint64(start + i)])
        clear = level + slope * along + (drop_along + drop_across * across * across)
        rounding = abs(q[v]) * SAME_BEARING
        out[uint64(place + i)] = own if clear <= own + GRAZING_TOLERANCE_M + rounding * along else clear
