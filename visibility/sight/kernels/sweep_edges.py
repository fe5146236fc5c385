"""Where the fast sweep takes in every edge that a ray crosses: near the eye, and where rays come onto the map."""

import math

import numpy as np

from compiled.options import scalar_kernel

__all__ = ["cross_strip", "enter", "first_strip", "rays_on_map"]


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
