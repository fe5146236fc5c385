"""One line of posts in the fast sweep: posts are answered, then every edge that a ray crosses raises the ray."""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import float32

from compiled.options import scalar_kernel
from visibility.sight.kernels.blocks import owned_posts
from visibility.sight.kernels.sweep_loops import Eye, PostRun, RayRun, advance, answer

__all__ = ["Line", "Rays", "cross_strip", "enter", "first_strip", "raise_straight", "rays_on_map", "sweep_line"]

NEAR_LINES = 16  # so far rays take in every edge: what one of them misses there, all posts behind it miss


@scalar_kernel
def rays_on_map(across_0, width):
    """Between which places on a line rays run: those that leave the map for a post more, others from the border."""
    return (-1.0 if across_0 >= 0.0 else -1e-4), (width if across_0 <= width - 1 else width - 1 + 1e-4)


@scalar_kernel
def enter(block, along, stride, line, rays, steepest):
    """Start each ray that has come onto the map since the last line with the edge of the border that it crossed.

    line: a ``sweep_lines.Line``; rays: (first, one past the last) of those on the map.
    """
    ground, before, ground_start, width = line.ground, line.before, line.first_post, line.width
    first_ray, past_ray = rays
    step = 1 if block.across_0 < 0.0 else -1
    border = 0 if step > 0 else width - 1
    beyond = abs(border - block.across_0)
    q = first_ray if step > 0 else past_ray - 1
    while first_ray <= q < past_ray:
        t = abs(block.t_0 + (block.first_ray + q * stride) * block.dt)
        # back from this line
        back = along - beyond / t
        if back >= 1.0:
            break
        # only now, for lines are cut to what rays can reach
        crossed = along - back
        here = ground[border - ground_start]
        height = here + (before[border - ground_start] - here) * back
        slope = (
            (height - block.altitude_m) / crossed
            + block.tilt_m
            - (block.drop_along_m + block.drop_across_m * t * t) * crossed
        )
        if slope > steepest[q]:
            steepest[q] = np.float32(slope)
        q += step


@scalar_kernel
def cross_strip(block, along, stride, line, rays, steepest):
    """Raise each ray by every edge that it crosses between the last line and this one.

    line: a ``sweep_lines.Line``; rays: (first, one past the last) of those on the map.
    """
    ground, before, ground_start, width = line.ground, line.before, line.first_post, line.width
    first_ray, past_ray = rays
    lean = block.direction
    for q in range(first_ray, past_ray):
        t = block.t_0 + (block.first_ray + q * stride) * block.dt
        here = block.across_0 + t * along
        there = here - t
        bend = block.drop_along_m + block.drop_across_m * t * t
        first = max(math.floor(min(here, there)), ground_start)
        last = min(math.ceil(max(here, there)), width - 1)
        for post in range(first, last + 1):
            for end in (post, post + lean):
                if max(ground_start, 0) <= end < width:
                    # lines back from this one
                    rate = t - (end - post)
                    back = (here - end) / rate if rate != 0.0 else -1.0
                    if 0.0 < back < 1.0:
                        height = ground[end - ground_start]
                        height += (before[post - ground_start] - height) * back
                        slope = (height - block.altitude_m) / (along - back) + block.tilt_m - bend * (along - back)
                        if slope > steepest[q]:
                            steepest[q] = np.float32(slope)


@scalar_kernel
def raise_straight(block, along, stride, line, rays, steepest):
    """Raise the rays that run over posts by each post itself: with unknown ground on both sides it has no edge.

    Those are the rays straight ahead and along the diagonals, from an eye that stands on the lines of posts. line: a
    ``sweep_lines.Line``; rays: (first, one past the last) of those on the map.
    """
    if block.across_0 != math.floor(block.across_0):
        return
    first_ray, past_ray = rays
    for lean in range(-1, 2):
        place = ((lean - block.t_0) / block.dt - block.first_ray) / stride
        q = math.floor(place + 0.5)
        across = block.across_0 + lean * along
        post = math.floor(across)
        if first_ray <= q < past_ray and abs(place - q) < 1e-6 and across == post and 0 <= post < line.width:
            bend = block.drop_along_m + block.drop_across_m * lean * lean
            slope = (line.ground[post - line.first_post] - block.altitude_m) / along + block.tilt_m - bend * along
            if slope > steepest[q]:
                steepest[q] = np.float32(slope)


@scalar_kernel
def first_strip(lines, block, stride, steepest):
    """Start each ray with the edges that it crosses between the eye and the sector's first line of posts.

    The nearer line of that strip lies at or behind the eye; lines[index, post] are heights.
    """
    along_0, across_0, altitude = block.along_0, block.across_0, block.altitude_m
    first, direction = block.first_line, block.direction
    before = first - direction
    count = (block.rays - 1) // stride + 1
    near, far = (before - along_0) * direction, abs(first - along_0)
    if not 0 <= before < lines.shape[0] or near > 0.0:
        return
    middle = math.floor(across_0)
    for q in range(count):
        t = block.t_0 + (block.first_ray + q * stride) * block.dt
        bend = block.drop_along_m + block.drop_across_m * t * t
        for post in range(max(middle - 1, 0), min(middle + 3, lines.shape[1])):
            for lean in (0, direction):
                end = post + lean
                if 0 <= end < lines.shape[1] and t != lean:
                    along = (post - across_0 - lean * near) / (t - lean)
                    if 0.0 < along <= far:
                        share = (along - near) / (far - near)
                        height = lines[before, post] + (lines[first, end] - lines[before, post]) * share
                        slope = (height - altitude) / along + block.tilt_m - bend * along
                        if slope > steepest[q]:
                            steepest[q] = np.float32(slope)
    steepest[count] = steepest[count - 1]


class Rays(NamedTuple):
    """A block's rays, and room for the inner loops to work in.

    steepest: (n,) float32, the steepest slope that each has met, in metres per step along. fan: (3, n) float32, see
    ``sweep_loops``. places: (STRIDE,) int32. picked: (3, STRIDE) float32.
    """

    steepest: Any
    fan: Any
    places: Any
    picked: Any


class Line(NamedTuple):
    """One line of posts: heights of it and of the one on the eye's side, float32, both from first_post on.

    width: posts on a whole line. ahead: see ``sweep_loops.Ahead``.
    """

    ground: Any
    before: Any
    first_post: int
    width: int
    ahead: Any


@scalar_kernel
def _answer_line(owned, block, spread, eye, line, out, rays):
    """Answer the owned posts of a line; the outermost post of the map has no neighbour aside on one side.

    spread: (ray number of a place straight ahead of the eye, rays per post, number of rays).
    """
    q_first, dq, count = spread
    lean, width, ground_start = block.direction, line.width, line.first_post
    start, stop = owned
    if stop <= start:
        return
    inner_start = max(start, 1) if lean < 0 else start
    inner_stop = min(stop, width - 1) if lean > 0 else stop
    drop_along_m = float32(block.drop_along_m * float(eye.along) * float(eye.along))
    drops = (drop_along_m, float32(block.drop_across_m))
    for piece in range(3):
        first, last, aside = inner_start, inner_stop, lean
        if piece == 1:
            first, last, aside = start, inner_start, 0
        elif piece == 2:
            first, last, aside = inner_stop, stop, 0
        if last > first:
            q = float32(max((first - block.across_0) * dq - q_first, 0.0))
            across = float32(first - block.across_0)
            run = PostRun(first - ground_start, last - first, aside, count - 1, q, float32(dq), across, first)
            answer(out, line, rays, run, eye, drops, float32(lean), block.is_eye_inside)
    # from beyond a border that runs along the sector, a line reaches the posts on it from outside: nothing is between
    if start == 0 and block.across_0 < 0.0:
        out[-ground_start] = line.ground[-ground_start]
    if stop == width and block.across_0 > width - 1:
        out[width - 1 - ground_start] = line.ground[width - 1 - ground_start]


@scalar_kernel
def sweep_line(block, index, stride, line, out, rays):
    """Answer the owned posts of one line, then let its edges raise the rays; returns (start, stop) of the owned.

    index: of the line; line: a ``Line``; out starts like it. Slopes are counted from a plane through the eye that falls
    by the block's tilt per line, so that float32 serves for eyes as far as satellites; its altitude on this line is
    ``Eye.level``.
    """
    width, steepest = line.width, rays.steepest
    along = abs(index - block.along_0)
    lean = block.direction
    count = (block.rays - 1) // stride + 1
    t_first = block.t_0 + block.first_ray * block.dt
    spacing = block.dt * stride * along
    level = float32(block.altitude_m - block.tilt_m * along)
    eye = Eye(level, float32(along), float32(1.0 / along), float32(block.tilt_m))
    owned = owned_posts(block, along, width)
    spread = (t_first / (block.dt * stride), 1.0 / spacing, count)
    _answer_line(owned, block, spread, eye, line, out, rays)

    across = block.across_0 + t_first * along
    q_from, q_to = 0, count
    left, right = rays_on_map(block.across_0, width)
    if across < left:
        q_from = math.ceil((left - across) / spacing)
    if across + (count - 1) * spacing > right:
        q_to = math.floor((right - across) / spacing) + 1
    if q_to > q_from:
        across += q_from * spacing
        base = min(max(math.floor(across), 0), width - 2)
        run = RayRun(
            q_from,
            q_to - q_from,
            q_to < count,
            base - line.first_post,
            width - 2 - base,
            float32(across - base),
            float32(spacing),
            lean,
        )
        advance(rays, line, run, eye)
        raise_straight(block, along, stride, line, (q_from, q_to), steepest)
        if along <= NEAR_LINES and abs(block.first_line - block.along_0) < along - 0.5:
            cross_strip(block, along, stride, line, (q_from, q_to), steepest)
        if block.across_0 < 0.0 or block.across_0 > width - 1:
            enter(block, along, stride, line, (q_from, q_to), steepest)
        steepest[count] = steepest[count - 1]
    return owned
