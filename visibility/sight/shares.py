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

Tasks = npt.NDArray[np.int64]
Reals = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Work:
    """The tables that the sweep kernels take: tasks and reals with one row per block, bins with one row per worker."""

    tasks: npt.NDArray[np.int64]
    reals: npt.NDArray[np.float64]
    bins: npt.NDArray[np.int64]


def evened(tasks: Tasks, reals: Reals, shape: tuple[int, int]) -> tuple[Tasks, Reals]:
    """One eye's blocks over a grid of some shape, one of them cut so that two workers have alike to do.

    tasks, reals: one row per block, see kernels.sweep.
    """
    cost = _cost(tasks, reals, shape)
    hands = _hands(cost, 2)
    loads = [cost[hand].sum() for hand in hands]
    surplus = abs(loads[0] - loads[1]) / 2
    if surplus <= UNEVEN * cost.sum() / 2:
        return tasks, reals
    full = hands[int(loads[1] > loads[0])]
    dearest = full[int(cost[full].argmax())]
    rays = tasks[dearest, 6] - 1
    moved = round(rays * surplus / cost[dearest] / COARSEST) * COARSEST
    if not 0 < moved < rays:
        return tasks, reals
    # both run the ray on which they are cut
    first, second = tasks[dearest].copy(), tasks[dearest].copy()
    first[6], first[8] = moved + 1, 0
    second[5], second[6], second[7] = first[5] + moved, rays - moved + 1, 0
    cut = np.vstack([tasks[:dearest], first, second, tasks[dearest + 1 :]])
    return cut, np.insert(reals, dearest, reals[dearest], axis=0)


def dealt(tasks: Tasks, reals: Reals, shape: tuple[int, int], workers: int) -> Work:
    """The blocks of any number of eyes, dealt to workers."""
    hands = _hands(_cost(tasks, reals, shape), workers)
    bins = np.full((workers, max(len(hand) for hand in hands)), -1, np.int64)
    for worker, hand in enumerate(hands):
        bins[worker, : len(hand)] = sorted(hand)
    return Work(tasks, reals, bins)


def _hands(cost: npt.NDArray[np.float64], workers: int) -> list[list[int]]:
    """Numbers of the blocks that each worker gets, the dearest dealt first to whoever has least."""
    hands: list[list[int]] = [[] for _ in range(workers)]
    loads = [(0.0, worker) for worker in range(workers)]
    for number in np.argsort(-cost, kind="stable"):
        load, worker = heapq.heappop(loads)
        hands[worker].append(int(number))
        heapq.heappush(loads, (load + cost[number], worker))
    return hands


def _cost(tasks: Tasks, reals: Reals, shape: tuple[int, int]) -> npt.NDArray[np.float64]:
    """What each block costs, about: posts answered and rays run on its lines, a sample of which is looked at."""
    axis, direction, first, steps, first_ray, rays = tasks[:, 1:7].T[:, :, np.newaxis]
    along_0, across_0, t_0, dt = reals[:, [0, 1, 3, 4]].T[:, :, np.newaxis]
    along = np.abs(first + direction * steps * (np.arange(SAMPLED_LINES) + 0.5) / SAMPLED_LINES - along_0)
    width = np.asarray(shape)[1 - axis]
    left = np.clip(across_0 + (t_0 + first_ray * dt) * along, 0, width)
    right = np.clip(across_0 + (t_0 + (first_ray + rays - 1) * dt) * along, 0, width)
    gap = dt * along
    gap *= 2.0 ** np.clip(np.floor(np.log2(WIDEST_GAP / gap)), 0, np.log2(tasks[:, 10, np.newaxis]))
    cost: npt.NDArray[np.float64] = ((right - left) * (1.0 + RAY_COST / gap)).mean(axis=1) * steps[:, 0]
    return cost * np.where(axis[:, 0] == 1, COLUMN_COST, 1.0)
