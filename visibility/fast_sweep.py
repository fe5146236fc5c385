"""Fast mode: plans the sectors and blocks of rays of the column-wise sweep and runs it."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator, Sequence

import numba
import numpy as np
import numpy.typing as npt

from .kernels import sweep as kernel

__all__ = ["Eye", "sweep"]

# An eye this close to a line of posts, in cells, is put on it: float32 slopes over less are noise.
SNAP_CELLS = 1e-3

# an eye: fractional row and column, altitude in metres
Eye = tuple[float, float, float]


def sweep(
    heights_m: npt.NDArray[np.float32],
    eyes: Sequence[Eye],
    drop_per_step2_m: tuple[float, float],
    out_m: npt.NDArray[np.float32],
) -> None:
    """Fill out_m (n_eyes, rows, cols) with the altitude that clears the ground between each post and each eye.

    heights_m: (rows, cols), at least 2 x 2. drop_per_step2_m: curvature drop in metres per squared row step and per
    squared column step.
    """
    tasks: list[tuple[int, ...]] = []
    reals: list[tuple[float, ...]] = []
    snapped = [(_snap(row), _snap(col), altitude_m) for row, col, altitude_m in eyes]
    for number, eye in enumerate(snapped):
        for task, real in _blocks(number, eye, heights_m.shape, drop_per_step2_m):
            tasks.append(task)
            reals.append(real)
    task_table = np.array(tasks, np.int64)
    workers = min(numba.get_num_threads(), len(tasks))
    kernel.sweep(heights_m, out_m, task_table, np.array(reals, np.float64), _deal(task_table, workers))
    for number, (row, col, _) in enumerate(snapped):
        if row.is_integer() and col.is_integer() and 0 <= row < heights_m.shape[0] and 0 <= col < heights_m.shape[1]:
            out_m[number, int(row), int(col)] = heights_m[int(row), int(col)]


def _snap(index: float) -> float:
    return float(round(index)) if abs(index - round(index)) < SNAP_CELLS else index


def _blocks(
    number: int, eye: Eye, shape: tuple[int, ...], drop_per_step2_m: tuple[float, float]
) -> Iterator[tuple[tuple[int, ...], tuple[float, ...]]]:
    """The blocks of rays of one eye: (task, real) rows as kernels.sweep wants them."""
    for axis in (0, 1):
        along_0, across_0 = eye[axis], eye[1 - axis]
        length, width = shape[axis], shape[1 - axis]
        drop_along, drop_across = drop_per_step2_m[axis], drop_per_step2_m[1 - axis]
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
            # one ray per post on the farthest line, one of them straight along the axis
            dt = 1.0 / far
            t_0 = math.floor(t_low / dt) * dt
            rays = math.ceil((t_high - t_0) / dt) + 1
            most = kernel.BLOCK_RAYS
            for first_ray in range(0, max(rays - 1, 1), most):
                last = first_ray + most >= rays - 1
                count = rays - first_ray if last else most + 1
                task = (number, axis, direction, first, steps, first_ray, count, int(first_ray == 0), int(last))
                yield task, (along_0, across_0, eye[2], t_0, dt, drop_along, drop_across)


def _deal(tasks: npt.NDArray[np.int64], workers: int) -> npt.NDArray[np.int64]:
    """Deal tasks to workers, the dearest first, so that all finish together; -1 fills the short hands."""
    cost = tasks[:, 4] * tasks[:, 6]
    hands: list[list[int]] = [[] for _ in range(workers)]
    loads = [(0, worker) for worker in range(workers)]
    for number in np.argsort(-cost, kind="stable"):
        load, worker = heapq.heappop(loads)
        hands[worker].append(int(number))
        heapq.heappush(loads, (load + int(cost[number]), worker))
    table = np.full((workers, max(len(hand) for hand in hands)), -1, np.int64)
    for worker, hand in enumerate(hands):
        table[worker, : len(hand)] = sorted(hand)
    return table
