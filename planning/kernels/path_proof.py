"""How far one limit must give before there is a way: the way whose worst square is best.

A node is a square, numbered row · cols + col. Diagonal steps pass a post, so all four squares around it count.
"""

import math

import numpy as np

from compiled.options import scalar_kernel

from .path_grid import lift, sink

__all__ = ["least_worst_way"]


@scalar_kernel
def _worst_of_step(value, row, col, r, c):
    """The worst square that a step from one square to a neighbour touches."""
    worst = max(value[row, col], value[r, c])
    if r != row and c != col:
        worst = max(worst, value[row, c], value[r, col])
    return worst


@scalar_kernel
def least_worst_way(value, starts, goals):
    """(worst value, nodes) of the way from any start to any goal whose worst square is least, the shortest of those.

    value: (rows, cols) float64, +inf = not to be entered. inf and no nodes where there is no way.
    """
    rows, cols = value.shape
    worst = np.full(rows * cols, math.inf)
    steps = np.zeros(rows * cols, np.int64)
    before = np.full(rows * cols, -1, np.int64)
    closed, ending = np.zeros(rows * cols, np.uint8), np.zeros(rows * cols, np.uint8)
    for node in goals:
        ending[node] = 1
    keys, items, size = np.empty(4096), np.empty(4096, np.int64), 0
    for node in starts:
        at = value[node // cols, node % cols]
        if at < worst[node]:
            worst[node] = at
            if size == keys.shape[0]:
                keys, items = np.append(keys, np.empty(size)), np.append(items, np.empty(size, np.int64))
            keys[size], items[size] = at, node
            lift(keys, items, size)
            size += 1
    last = -1
    while size > 0:
        node = items[0]
        sink(keys, items, size)
        size -= 1
        if closed[node]:
            continue
        closed[node] = 1
        if ending[node]:
            last = node
            break
        row, col = node // cols, node % cols
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            for c in range(max(col - 1, 0), min(col + 2, cols)):
                there = r * cols + c
                if closed[there]:
                    continue
                found = max(worst[node], _worst_of_step(value, row, col, r, c))
                if found < worst[there] or (found == worst[there] and steps[node] + 1 < steps[there]):
                    worst[there], before[there], steps[there] = found, node, steps[node] + 1
                    if found == math.inf:
                        continue
                    if size == keys.shape[0]:
                        keys, items = np.append(keys, np.empty(size)), np.append(items, np.empty(size, np.int64))
                    keys[size], items[size] = found, there
                    lift(keys, items, size)
                    size += 1
    if last < 0:
        return math.inf, np.empty(0, np.int64)
    result = worst[last]
    length, node = 0, last
    while node >= 0:
        length += 1
        node = before[node]
    nodes, node = np.empty(length, np.int64), last
    for i in range(length - 1, -1, -1):
        nodes[i] = node
        node = before[node]
    return result, nodes
