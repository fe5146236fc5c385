"""How both sweeps cut up their work, four sectors around an eye and blocks of bearings in each, and who sweeps which.

How an eye's blocks are cut depends on the eye and the grid alone: rays of another block are rounded otherwise, and an
answer must not depend on how many threads there are or on who else is asked about.
Blocks are dealt so that all threads finish together.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numba
import numpy as np
import numpy.typing as npt

from visibility.sight.fans import Fan, entering_fans, plain_fan
from visibility.sight.kernels.blocks import BLOCK_FIELDS, Block
from visibility.sight.kernels.sweep import COARSEST, WIDEST_GAP

__all__ = ["Eye", "Work", "dealt", "evened", "share_out", "snapped", "write_own_posts"]

SAMPLED_LINES = 16
RAY_COST = 1.2  # of a ray on a line, in answers to a post
COLUMN_COST = 1.3  # of sectors that run over columns, in such as run over rows
UNEVEN = 0.02  # of a fair load: too little to cut a block for

Blocks = npt.NDArray[np.void]  # records of kernels.blocks.BLOCK_FIELDS


@dataclass(frozen=True, slots=True)
class Work:
    """What the sweep kernels take: blocks (n,) of BLOCK_FIELDS, and bins with one row of numbers of them per worker."""

    blocks: Blocks
    bins: npt.NDArray[np.int64]


def evened(blocks: Blocks, shape: tuple[int, int]) -> Blocks:
    """One eye's blocks over a grid of some shape, one of them cut so that two workers have alike to do."""
    cost = _cost(blocks, shape)
    hands = _hands(cost, 2)
    loads = [cost[hand].sum() for hand in hands]
    surplus = abs(loads[0] - loads[1]) / 2
    if surplus <= UNEVEN * cost.sum() / 2:
        return blocks
    full = hands[int(loads[1] > loads[0])]
    dearest = full[int(cost[full].argmax())]
    rays = int(blocks["rays"][dearest]) - 1
    moved = round(rays * surplus / cost[dearest] / COARSEST) * COARSEST
    one = blocks[dearest]
    bearing = float(one["t_0"] + (one["first_ray"] + moved) * one["dt"])
    # among a fan's rays to spare, beyond its sector, a cut would give one of the two the next sector's posts as well
    if not (0 < moved < rays and -1.0 < bearing < 1.0):
        return blocks
    # both run the ray on which they are cut
    cut = np.insert(blocks, dearest, blocks[dearest])
    first, second = cut[dearest], cut[dearest + 1]
    first["rays"], first["is_last"] = moved + 1, False
    second["first_ray"] += moved
    second["rays"], second["is_first"] = rays - moved + 1, False
    return cut


def dealt(blocks: Blocks, shape: tuple[int, int], workers: int) -> Work:
    """The blocks of any number of eyes, dealt to workers."""
    hands = _hands(_cost(blocks, shape), workers)
    bins = np.full((workers, max(len(hand) for hand in hands)), -1, np.int64)
    for worker, hand in enumerate(hands):
        bins[worker, : len(hand)] = sorted(hand)
    return Work(blocks, bins)


def _hands(cost: npt.NDArray[np.float64], workers: int) -> list[list[int]]:
    """Numbers of the blocks that each worker gets, the dearest dealt first to whoever has least."""
    hands: list[list[int]] = [[] for _ in range(workers)]
    loads = [(0.0, worker) for worker in range(workers)]
    for number in np.argsort(-cost, kind="stable"):
        load, worker = heapq.heappop(loads)
        hands[worker].append(int(number))
        heapq.heappush(loads, (load + cost[number], worker))
    return hands


def _cost(blocks: Blocks, shape: tuple[int, int]) -> npt.NDArray[np.float64]:
    """What each block costs, about: posts answered and rays run on its lines, a sample of which is looked at."""
    one = blocks[:, np.newaxis]
    on_lines = one["lines"] * (np.arange(SAMPLED_LINES) + 0.5) / SAMPLED_LINES
    along = np.abs(one["first_line"] + one["direction"] * on_lines - one["along_0"])
    width = np.asarray(shape)[1 - one["axis"]]
    last_ray = one["first_ray"] + one["rays"] - 1
    left = np.clip(one["across_0"] + (one["t_0"] + one["first_ray"] * one["dt"]) * along, 0, width)
    right = np.clip(one["across_0"] + (one["t_0"] + last_ray * one["dt"]) * along, 0, width)
    gap = one["dt"] * along
    gap *= 2.0 ** np.clip(np.floor(np.log2(WIDEST_GAP / gap)), 0, np.log2(one["coarsest"]))
    cost: npt.NDArray[np.float64] = ((right - left) * (1.0 + RAY_COST / gap)).mean(axis=1) * blocks["lines"]
    return cost * np.where(blocks["axis"] == 1, COLUMN_COST, 1.0)


# an eye: fractional row and column, altitude in metres
Eye = tuple[float, float, float]


def snapped(eyes: Sequence[Eye], within_cells: float) -> list[Eye]:
    """Eyes with a row or column so close to a line of posts put on it: over less, slopes are rounding."""

    def snap(index: float) -> float:
        return float(round(index)) if abs(index - round(index)) < within_cells else float(index)

    return [(snap(row), snap(col), altitude_m) for row, col, altitude_m in eyes]


def write_own_posts(heights_m: npt.NDArray[np.float32], eyes: Sequence[Eye], out_m: npt.NDArray[np.float32]) -> None:
    """Answer the post straight below an eye, which lies in no sector, in place."""
    rows, cols = heights_m.shape
    for number, (row, col, _) in enumerate(eyes):
        if row.is_integer() and col.is_integer() and 0 <= row < rows and 0 <= col < cols:
            out_m[number, int(row), int(col)] = heights_m[int(row), int(col)]


def share_out(
    eyes: Sequence[Eye],
    heights_m: npt.NDArray[np.float32],
    drop_per_step2_m: tuple[float, float],
    block_rays: int,
    workers: int | None = None,
    *,
    follow_borders: bool = False,
) -> Work:
    """Blocks of about ``block_rays`` bearings (at most twice as many) for every eye over a grid, dealt to workers.

    drop_per_step2_m: curvature drop in metres per squared row step and per squared column step. workers: None = as many
    as numba has threads. follow_borders: bearings at which lines graze a border that they enter the map across are as
    dense as posts on it.
    """
    rows, cols = heights_m.shape
    ground_m = _some_ground_m(heights_m)
    of_eyes = []
    for number, eye in enumerate(eyes):
        blocks = list(_blocks(number, eye, (rows, cols), ground_m, drop_per_step2_m, block_rays, follow_borders))
        of_eyes.append(evened(np.array([tuple(block) for block in blocks], BLOCK_FIELDS), (rows, cols)))
    workers = numba.get_num_threads() if workers is None else workers
    return dealt(np.concatenate(of_eyes), (rows, cols), workers)


def _some_ground_m(heights_m: npt.NDArray[np.float32]) -> float:
    """A height that the ground has somewhere; 0 where a coarse look finds only unknown posts."""
    some = heights_m[::64, ::64]
    known = some[~np.isnan(some)]
    return float(known.mean()) if known.size else 0.0


def _blocks(
    number: int,
    eye: Eye,
    shape: tuple[int, int],
    ground_m: float,
    drop_per_step2_m: tuple[float, float],
    block_rays: int,
    follow_borders: bool,
) -> Iterator[Block]:
    """The blocks of one eye."""
    is_inside = 0.0 <= eye[0] <= shape[0] - 1 and 0.0 <= eye[1] <= shape[1] - 1
    for axis in (0, 1):
        along_0, across_0 = eye[axis], eye[1 - axis]
        length, width = shape[axis], shape[1 - axis]
        drop_along_m, drop_across_m = drop_per_step2_m[axis], drop_per_step2_m[1 - axis]
        for direction in (1, -1):
            first = max(0, math.floor(along_0) + 1) if direction > 0 else min(length - 1, math.ceil(along_0) - 1)
            steps = length - first if direction > 0 else first + 1
            if steps <= 0:
                continue
            near, far = abs(first - along_0), abs(first + direction * (steps - 1) - along_0)
            t_low = max(-1.0, min(-across_0 / near, -across_0 / far))
            t_high = min(1.0, max((width - 1 - across_0) / near, (width - 1 - across_0) / far))
            if t_low > t_high:
                continue
            # an eye beyond the map looks over it along a plane that falls to the ground in its middle
            tilt_m = 2.0 * (eye[2] - ground_m) / (near + far) if near > 1.0 else 0.0
            # an eye beyond a border that runs along the sector: its lines come onto the map across it
            beyond = max(-across_0, across_0 - (width - 1))
            reach = (t_low, t_high, near, far)
            entering = follow_borders and beyond > 0.0
            fans = entering_fans(across_0, beyond, reach) if entering else [plain_fan(across_0, reach)]
            for number_of_fan, fan in enumerate(fans):
                ends = number_of_fan == 0, number_of_fan == len(fans) - 1
                # lines that none of its rays has reached the map on are left out
                empty = fan.lines_before(beyond, near) if entering else 0
                for first_ray, count, is_first, is_last in _cut(fan, block_rays, ends):
                    yield Block(
                        along_0=along_0,
                        across_0=across_0,
                        altitude_m=eye[2],
                        t_0=fan.t_0,
                        dt=fan.dt,
                        drop_along_m=drop_along_m,
                        drop_across_m=drop_across_m,
                        tilt_m=tilt_m,
                        eye=number,
                        axis=axis,
                        direction=direction,
                        first_line=first + direction * empty,
                        lines=steps - empty,
                        first_ray=first_ray,
                        rays=count,
                        coarsest=fan.coarsest,
                        is_first=is_first,
                        is_last=is_last,
                        is_eye_inside=is_inside,
                    )


def _cut(fan: Fan, block_rays: int, ends: tuple[bool, bool]) -> Iterator[tuple[int, int, bool, bool]]:
    """(first ray, number of rays, whether it is the sector's first, whether its last) of each block of a fan.

    ends: whether the fan is the sector's first, whether its last.
    """
    # blocks of like size, rather than full ones and a splinter
    blocks = max(round((fan.rays - 1) / block_rays), 1)
    each = math.ceil((fan.rays - 1) / (blocks * COARSEST)) * COARSEST
    for first_ray in range(0, fan.rays - 1, each):
        last = first_ray + each >= fan.rays - 1
        count = fan.rays - first_ray if last else each + 1
        yield first_ray, count, ends[0] and first_ray == 0, ends[1] and last
