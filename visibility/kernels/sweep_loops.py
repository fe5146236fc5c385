"""The inner loops of the fast sweep: rays take in a line of posts, posts are answered from rays, tiles are turned."""

import numpy as np
from numba import float32, int32, uint64

from terrain.kernel_options import inner_loop

__all__ = ["NEAR", "NOT_BLOCKED", "NO_GROUND", "advance", "answer", "turn_in", "turn_out", "whole_places"]

NOT_BLOCKED = np.float32(-1e28)  # the slope of a ray that has met no edge yet
NO_GROUND = np.float32(-1e30)  # and of one that has not even come onto the map
NEAR = 3  # the row of a fan where what lies beside its rays or posts begins
HALF = np.float32(0.5)

GRAZING_TOLERANCE_M = np.float32(1e-3)  # float32 slopes over kilometres are good to about this


@inner_loop
def whole_places(places, count, first, step, last):
    """places[i] = the whole part of first + i step, held within 0..last, for i < count."""
    for i in range(count):
        places[i] = min(max(int32(first + step * float32(i)), int32(0)), int32(last))


@inner_loop
def advance(fan, posts, steepest, where, lateral, eye):
    """Raise each ray's steepest slope by the edge of this line that it crosses and by the last edge before it.

    fan: (6, n), per ray: bend, per_lean and per_across, see _load_rays in sweep.py; from row NEAR on, per ray of this
    line, the heights of the posts on its left and right, and of the post at which both edges end that it can cross
    behind this line. posts: number of the post on its left, counted as lateral is.
    where: (first ray, number of rays, lean). lateral: (across of the first ray, spacing).
    eye: (level on this line, along, 1 / along, tilt), see _line in sweep.py.
    """
    first_ray, count, lean = where
    start, step = lateral
    level, along, per_along, tilt = eye
    one = float32(1.0)
    zero = float32(0.0)
    for i in range(count):
        q = uint64(i + first_ray)
        # a ray less than a post beyond the border sees the ground go on as it ends, so that border posts have a ray on
        # either side
        part = start + step * float32(i) - float32(posts[i])
        left = fan[uint64(NEAR + 0), uint64(i)]
        right = fan[uint64(NEAR + 1), uint64(i)]
        behind = fan[uint64(NEAR + 2), uint64(i)]
        bend = fan[uint64(0), q]
        slope = (left + (right - left) * part - level) * per_along - bend * along
        # going back towards the eye the ray next crosses the diagonal or, leaning more than it, the straight edge;
        # both end at the same post of the line before
        part = one - part if lean > 0 else part
        to_diagonal = part * fan[uint64(1), q]
        to_straight = (one - part) * fan[uint64(2), q]
        first = right if lean > 0 else left
        second = left if lean > 0 else right
        diagonal = to_diagonal <= one
        reach = min(max(to_diagonal if diagonal else to_straight, zero), one)
        at = first if diagonal else second
        there = along - reach
        cross = (at + (behind - at - tilt) * reach - level) / there - bend * there
        best = slope if slope > steepest[q] else steepest[q]
        steepest[q] = cross if cross > best else best


@inner_loop
def answer(out, ground, before, fan, rays, where, scale, eye):
    """Altitude over each post of one line that clears what its two neighbouring rays have met, and its last diagonal.

    out, ground, before: this line's answers and heights, and heights of the line on the eye's side. A post's neighbour
    aside on this line and the same post on the line before together hold the one edge that a sight line to the post
    can still cross after the line before.
    fan: from row NEAR on, the steepest slopes of the rays on the left and right of each post; rays: number of the one
    on its left.
    where: (first post, number of posts, offset of the neighbour aside, 0 = there is none).
    scale: (ray number of the first post, rays per post, across of the first post, drop along, drop per square across,
    lean); eye: as for advance.
    """
    first, count, aside = where
    q_0, dq, across_0, drop_0, drop_across, lean = scale
    level, along, per_along, tilt = eye
    one = float32(1.0)
    hidden_by_aside = float32(0.0) if aside != 0 else float32(-2.0)
    for i in range(count):
        post = uint64(i + first)
        part = q_0 + float32(i) * dq - float32(rays[i])
        left = fan[uint64(NEAR + 0), uint64(i)]
        right = fan[uint64(NEAR + 1), uint64(i)]
        # beside the border of the map one of the two may not have come onto it: the nearer one decides
        nearer = left if part < HALF else right
        lower = left if left < right else right
        left = left if lower > NO_GROUND else nearer
        right = right if lower > NO_GROUND else nearer
        slope = left + (right - left) * part
        across = across_0 + float32(i)
        drop = drop_0 + drop_across * across * across
        # the edge lies 1 / lag posts back: both its height over the eye and its distance are taken lag times
        bearing = across * per_along * lean
        lag = one - bearing
        there = along * lag - one
        beside = ground[uint64(i + first + aside)]
        last = ((beside - level) * lag + (before[post] - beside - tilt)) / there
        last -= drop * per_along * (one - per_along)
        last = last if bearing < hidden_by_aside else slope
        slope = last if last > slope else slope
        own = ground[post]
        clear = level + slope * along + drop
        out[post] = clear if not clear <= own + GRAZING_TOLERANCE_M else own


@inner_loop
def turn_in(heights, lines):
    """Copy a tile (rows, lines) of the grid into lines (lines, rows).

    Row by row: rows of a grid whose width is a power of two share their places in the cache and would evict one
    another.
    """
    rows, n = heights.shape
    for row in range(rows):
        for k in range(n):
            lines[k, row] = heights[row, k]


@inner_loop
def turn_out(lines, out, start, stop):
    """Copy what each line owns, rows [start, stop), from lines (lines, rows) into a tile (rows, lines) of the grid."""
    rows, n = out.shape
    all_from, all_to = start.max(), stop.min()
    for row in range(rows):
        if all_from <= row < all_to:
            for k in range(n):
                out[row, k] = lines[k, row]
        else:
            for k in range(n):
                if start[k] <= row < stop[k]:
                    out[row, k] = lines[k, row]
