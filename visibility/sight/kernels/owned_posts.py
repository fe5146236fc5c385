"""Which posts of a line a block of rays answers for, so that every post of the grid has exactly one owner."""

import math

from compiled.options import scalar_kernel

__all__ = ["owned_posts"]


@scalar_kernel
def _sector_start(across_0, along, strict):
    """First whole post with across >= -along (> when strict), decided by the difference that both sectors compute."""
    post = math.ceil(across_0 - along)
    while post - across_0 < -along or (strict and post - across_0 == -along):
        post += 1
    while post - 1 - across_0 > -along or (not strict and post - 1 - across_0 == -along):
        post -= 1
    return int(post)


@scalar_kernel
def _sector_stop(across_0, along, strict):
    """One past the last whole post with across <= along (< when strict)."""
    post = math.floor(across_0 + along)
    while post - across_0 > along or (strict and post - across_0 == along):
        post -= 1
    while post + 1 - across_0 < along or (not strict and post + 1 - across_0 == along):
        post += 1
    return int(post) + 1


@scalar_kernel
def owned_posts(task, real, along, width):
    """Posts [start, stop) of one line that this block answers for; every post of the grid has exactly one owner."""
    across_0, t_0, dt = real[1], real[3], real[4]
    strict = task[1] == 1
    if task[7] == 1:
        start = _sector_start(across_0, along, strict)
    else:
        start = math.ceil(across_0 + (t_0 + task[5] * dt) * along)
    if task[8] == 1:
        stop = _sector_stop(across_0, along, strict)
    else:
        stop = math.ceil(across_0 + (t_0 + (task[5] + task[6] - 1) * dt) * along)
    return max(start, 0), min(stop, width)
