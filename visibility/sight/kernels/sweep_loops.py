"""The inner loops of the fast sweep: rays take in a line of posts, posts are answered from rays.

Rays and posts are taken a stride at a time, so that what is picked for them stays in the nearest cache and the loops
have no odd ends. Their counters become float32 by way of int32: without AVX-512 no vector of 64-bit ones does.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import float32, int32, uint64

from compiled.options import inner_loop
from compiled.vectors import LANES, pick, pick_pair, pick_pair_wide, prefetch
from visibility.sight.kernels.turning import CACHE_LINE

__all__ = [
    "BEND",
    "NOT_BLOCKED",
    "NO_GROUND",
    "PER_ACROSS",
    "PER_LEAN",
    "STRIDE",
    "Ahead",
    "Eye",
    "PostRun",
    "RayRun",
    "advance",
    "answer",
]

NOT_BLOCKED = np.float32(-1e28)  # the slope of a ray that has met no edge yet
NO_GROUND = np.float32(-1e30)  # and of one that has not even come onto the map
STRIDE = 64
# From one ray to the next in posts, or from one post to the next in rays, up to which a vector of them finds its places
# in one, two or four vectors: a place may round up to the next.
ONE_STEP = np.float32((LANES - 1.01) / (LANES - 1))
NEAR_STEP = np.float32((2 * LANES - 3.01) / (LANES - 1))
WIDE_STEP = np.float32((4 * LANES - 3.01) / (LANES - 1))
HALF = np.float32(0.5)

GRAZING_TOLERANCE_M = np.float32(1e-3)  # float32 slopes over kilometres are good to about this

# rows of a fan of rays: curvature drop per square step along, and how far back a ray meets a diagonal or a straight
# edge, per post across
BEND, PER_LEAN, PER_ACROSS = 0, 1, 2
# rows of what is picked for a ray: heights on its left and right on this line, and of the post of the line before at
# which both edges end that it can cross behind this line; for a post: what the rays on its left and right have met
LEFT, RIGHT, BEHIND = 0, 1, 2


class Eye(NamedTuple):
    """How a line lies to the eye: the plane's altitude there, how far along it is, 1 / along, fall of the plane, m."""

    level: Any
    along: Any
    per_along: Any
    tilt: Any


class RayRun(NamedTuple):
    """Rays that follow each other: the first, how many, whether others follow them.

    Posts are counted from base on, up to last; across: of the first ray, from there; spacing: from ray to ray; lean:
    which way diagonals go, 1 or -1.
    """

    first: int
    rays: int
    others_follow: bool
    base: int
    last: int
    across: Any
    spacing: Any
    lean: int


class PostRun(NamedTuple):
    """Posts that follow each other: the first, how many, the offset of the neighbour aside, 0 = there is none.

    last_place: of a ray. q: ray number of the first post; dq: rays per post; across: of the first post from the eye;
    col: its column in the grids of ``Ahead``.
    """

    first: int
    posts: int
    aside: int
    last_place: int
    q: Any
    dq: Any
    across: Any
    col: int


class Ahead(NamedTuple):
    """Parts of lines to come, heights and answers, which lie somewhere else in memory; row -1 = nothing to ask for.

    The processor does not foresee where. They are asked for bit by bit, or all other reading would wait.
    """

    grid: Any
    grid_row: int
    answers: Any
    answers_row: int


@inner_loop
def advance(rays, line, run, eye):
    """Raise each ray's steepest slope by the edge of this line that it crosses and by the last edge before it.

    rays, line: see ``sweep_lines``; run: a RayRun. Writes up to a stride beyond the last ray.
    """
    steepest, fan, places, picked = rays
    ground, before = line.ground, line.before
    first_ray, count, others_follow, base, last, across, spacing, lean = run
    level, along, per_along, tilt = eye
    one = float32(1.0)
    zero = float32(0.0)
    behind_base = base + (0 if lean > 0 else 1)
    for start in range(0, count, STRIDE):
        begin = across + spacing * float32(start)
        end = begin + spacing * float32(STRIDE - 1)
        inside = begin >= zero and end < float32(last) and base + int32(end) + 2 * LANES < ground.shape[0]
        if inside and spacing <= ONE_STEP:
            for i in range(STRIDE):
                places[i] = int32(begin + spacing * float32(int32(i)))
            for i in range(0, STRIDE, LANES):
                pick(ground, base, places, i, picked, LEFT)
                pick(ground, base + 1, places, i, picked, RIGHT)
                pick(before, behind_base, places, i, picked, BEHIND)
        else:
            for i in range(STRIDE):
                places[i] = min(max(int32(begin + spacing * float32(int32(i))), int32(0)), int32(last))
                picked[LEFT, i] = ground[base + places[i]]
                picked[RIGHT, i] = ground[base + places[i] + 1]
                picked[BEHIND, i] = before[behind_base + places[i]]
        for i in range(min(count - start, STRIDE) if others_follow else STRIDE):
            q = uint64(i + start + first_ray)
            # a ray less than a post beyond the border sees the ground go on as it ends, so that border posts have a
            # ray on either side
            part = begin + spacing * float32(int32(i)) - float32(places[i])
            left = picked[uint64(LEFT), uint64(i)]
            right = picked[uint64(RIGHT), uint64(i)]
            behind = picked[uint64(BEHIND), uint64(i)]
            bend = fan[uint64(BEND), q]
            slope = (left + (right - left) * part - level) * per_along - bend * along
            # going back towards the eye the ray next crosses the diagonal or, leaning more than it, the straight edge;
            # both end at the same post of the line before
            part = one - part if lean > 0 else part
            to_diagonal = part * fan[uint64(PER_LEAN), q]
            to_straight = (one - part) * fan[uint64(PER_ACROSS), q]
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
def answer(out, line, rays, run, eye, drops, lean, is_eye_inside):
    """Altitude over each post of one line that clears what its two neighbouring rays have met, and its last diagonal.

    A post's neighbour aside on this line and the same post on the line before together hold the one edge that a sight
    line to the post can still cross after the line before.
    out: the line's answers; line, rays: see ``sweep_lines``; run: a PostRun. drops: curvature drop along, and per
    square across. lean: 1 or -1, float32. is_eye_inside: whether the eye is over the map.
    """
    steepest, _, places, picked = rays
    ground, before = line.ground, line.before
    grid, grid_row, answers, answers_row = line.ahead
    first, count, aside, last_place, q_0, dq, across_0, first_col = run
    level, along, per_along, tilt = eye
    drop_0, drop_across = drops
    one = float32(1.0)
    hidden_by_aside = float32(0.0) if aside != 0 else float32(-2.0)
    for start in range(0, count, STRIDE):
        # the last stride of a long line answers some posts again, alike
        begin = min(start, max(count - STRIDE, 0))
        q_begin, across_begin = q_0 + float32(begin) * dq, across_0 + float32(begin)
        for i in range(STRIDE):
            places[i] = min(max(int32(q_begin + float32(int32(i)) * dq), int32(0)), int32(last_place))
        # near the eye, where rays are close together, a vector of posts spans more of them
        if dq <= NEAR_STEP:
            for i in range(0, STRIDE, LANES):
                pick_pair(steepest, 0, places, i, picked, LEFT)
        elif dq <= WIDE_STEP:
            for i in range(0, STRIDE, LANES):
                pick_pair_wide(steepest, 0, places, i, picked, LEFT)
        else:
            for i in range(STRIDE):
                picked[LEFT, i] = steepest[places[i]]
                picked[RIGHT, i] = steepest[places[i] + 1]
        for col in range(first_col + begin, first_col + begin + STRIDE, CACHE_LINE):
            if grid_row >= 0:
                prefetch(grid, grid_row, col)
            if answers_row >= 0:
                prefetch(answers, answers_row, col)
        for i in range(min(count, STRIDE)):
            post = uint64(i + begin + first)
            part = q_begin + float32(int32(i)) * dq - float32(places[i])
            left = picked[uint64(LEFT), uint64(i)]
            right = picked[uint64(RIGHT), uint64(i)]
            # beside the border of the map one of the two may not have come onto it: the nearer one decides
            if not is_eye_inside:
                nearer = left if part < HALF else right
                lower = left if left < right else right
                left = left if lower > NO_GROUND else nearer
                right = right if lower > NO_GROUND else nearer
            slope = left + (right - left) * part
            across = across_begin + float32(int32(i))
            drop = drop_0 + drop_across * across * across
            # the edge lies 1 / lag posts back: both its height over the eye and its distance are taken lag times
            bearing = across * per_along * lean
            lag = one - bearing
            there = along * lag - one
            beside = ground[uint64(i + begin + first + aside)]
            last = ((beside - level) * lag + (before[post] - beside - tilt)) / there
            last -= drop * per_along * (one - per_along)
            last = last if bearing < hidden_by_aside else slope
            slope = last if last > slope else slope
            own = ground[post]
            clear = level + slope * along + drop
            out[post] = clear if not clear <= own + GRAZING_TOLERANCE_M else own
