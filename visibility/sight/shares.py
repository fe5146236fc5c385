"""Who sweeps which block of bearings: dealt so that all threads finish together.

How an eye's blocks are cut depends on the eye and the grid alone: rays of another block are rounded otherwise, and an
answer must not depend on how many threads there are or on who else is asked about.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from visibility.sight.kernels.sweep import COARSEST, WIDEST_GAP

__all__ = ["Work", "dealt", "evened"]

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
    if not 0 < moved < rays:
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
