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
def enter(task, real, along, stride, lines, rays, steepest):
    """Start each ray that has come onto the map since the last line with the edge of the border that it crossed.

    rays: (first, one past the last) of those on the map.
    """
    ground, before, ground_start, width = lines
    step = 1 if real[1] < 0.0 else -1
    border = 0 if step > 0 else width - 1
    beyond = abs(border - real[1])
    q = rays[0] if step > 0 else rays[1] - 1
    while rays[0] <= q < rays[1]:
        t = abs(real[3] + (task[5] + q * stride) * real[4])
        # back from this line
        back = along - beyond / t
        if back >= 1.0:
            break
        # only now, for lines are cut to what rays can reach
        crossed = along - back
        here = ground[border - ground_start]
        height = here + (before[border - ground_start] - here) * back
        slope = (height - real[2]) / crossed + real[7] - (real[5] + real[6] * t * t) * crossed
        if slope > steepest[q]:
            steepest[q] = np.float32(slope)
        q += step


@scalar_kernel
def cross_strip(task, real, along, stride, lines, rays, steepest):
    """Raise each ray by every edge that it crosses between the last line and this one.

    rays: (first, one past the last) of those on the map.
    """
    ground, before, ground_start, width = lines
    lean = task[2]
    for q in range(rays[0], rays[1]):
        t = real[3] + (task[5] + q * stride) * real[4]
        here = real[1] + t * along
        there = here - t
        bend = real[5] + real[6] * t * t
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
                        slope = (height - real[2]) / (along - back) + real[7] - bend * (along - back)
                        if slope > steepest[q]:
                            steepest[q] = np.float32(slope)


@scalar_kernel
def first_strip(lines, task, real, stride, steepest):
    """Start each ray with the edges that it crosses between the eye and the sector's first line of posts.

    The nearer line of that strip lies at or behind the eye; lines[index, post] are heights.
    """
    along_0, across_0, altitude = real[0], real[1], real[2]
    first, direction = task[3], task[2]
    before = first - direction
    count = (task[6] - 1) // stride + 1
    near, far = (before - along_0) * direction, abs(first - along_0)
    if not 0 <= before < lines.shape[0] or near > 0.0:
        return
    middle = math.floor(across_0)
    for q in range(count):
        t = real[3] + (task[5] + q * stride) * real[4]
        for post in range(max(middle - 1, 0), min(middle + 3, lines.shape[1])):
            for lean in (0, direction):
                end = post + lean
                if 0 <= end < lines.shape[1] and t != lean:
                    along = (post - across_0 - lean * near) / (t - lean)
                    if 0.0 < along <= far:
                        share = (along - near) / (far - near)
                        height = lines[before, post] + (lines[first, end] - lines[before, post]) * share
                        slope = (height - altitude) / along + real[7] - (real[5] + real[6] * t * t) * along
                        if slope > steepest[q]:
                            steepest[q] = np.float32(slope)
    steepest[count] = steepest[count - 1]
