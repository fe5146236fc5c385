"""A block: some neighbouring rays (or bearings) of one sector of one eye, which one worker carries outward.

Of each line of posts that it crosses a block answers for some, so that every post of the grid has exactly one owner.
"""

import math
from typing import NamedTuple

import numpy as np

from compiled.options import scalar_kernel

__all__ = ["BLOCK_FIELDS", "Block", "block_of", "owned_posts"]

# a table of blocks has one record each; its fields are those of Block
BLOCK_FIELDS = np.dtype(
    [
        *((name, np.float64) for name in ("along_0", "across_0", "altitude_m", "t_0", "dt")),
        *((name, np.float64) for name in ("drop_along_m", "drop_across_m", "tilt_m")),
        *((name, np.int64) for name in ("eye", "axis", "direction", "first_line", "lines")),
        *((name, np.int64) for name in ("first_ray", "rays", "coarsest")),
        *((name, np.bool_) for name in ("is_first", "is_last", "is_eye_inside")),
    ],
    align=True,
)


class Block(NamedTuple):
    """What kernels are told of a block; an axis of 0 runs over rows, 1 over columns.

    along_0, across_0: of the eye, in posts along and across the sector; altitude_m: its own. t_0, dt: bearing of the
    sector's ray 0 and from one ray to the next, posts across per post along. drop_along_m, drop_across_m: curvature
    drops per square step. tilt_m: by how much per line the plane falls that slopes are counted from.
    eye: its number. direction: 1 or -1, in which lines follow each other from first_line on, so many of them.
    first_ray, rays: of the sector's; rays - 1 is a multiple of ``sweep.COARSEST``. coarsest: near the eye only every so
    many of them run. is_first, is_last: of the sector's blocks. is_eye_inside: whether the eye is over the grid.
    """

    along_0: float
    across_0: float
    altitude_m: float
    t_0: float
    dt: float
    drop_along_m: float
    drop_across_m: float
    tilt_m: float
    eye: int
    axis: int
    direction: int
    first_line: int
    lines: int
    first_ray: int
    rays: int
    coarsest: int
    is_first: bool
    is_last: bool
    is_eye_inside: bool


@scalar_kernel
def block_of(blocks, number):
    """One record of a table of blocks (n,) of BLOCK_FIELDS."""
    record = blocks[number]
    return Block(
        record.along_0,
        record.across_0,
        record.altitude_m,
        record.t_0,
        record.dt,
        record.drop_along_m,
        record.drop_across_m,
        record.tilt_m,
        record.eye,
        record.axis,
        record.direction,
        record.first_line,
        record.lines,
        record.first_ray,
        record.rays,
        record.coarsest,
        record.is_first,
        record.is_last,
        record.is_eye_inside,
    )


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
def owned_posts(block, along, width):
    """Posts [start, stop) of one line that this block answers for; every post of the grid has exactly one owner."""
    across_0, t_0, dt = block.across_0, block.t_0, block.dt
    strict = block.axis == 1
    if block.is_first:
        start = _sector_start(across_0, along, strict)
    else:
        start = math.ceil(across_0 + (t_0 + block.first_ray * dt) * along)
    if block.is_last:
        stop = _sector_stop(across_0, along, strict)
    else:
        stop = math.ceil(across_0 + (t_0 + (block.first_ray + block.rays - 1) * dt) * along)
    return max(start, 0), min(stop, width)
