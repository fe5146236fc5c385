"""Paths over the squares of a field: from middle to middle, by A*; see path_segments for what a field is.

A node is a square, numbered row · cols + col; its place is its middle.
"""

import math

import numpy as np

from compiled.options import scalar_kernel

from .path_segments import segment_cost, step_cost

__all__ = ["costs_from", "lift", "search", "sink"]


@scalar_kernel
def lift(keys, items, place):
    """Move an entry of a binary heap up to where it belongs."""
    key, item = keys[place], items[place]
    while place > 0:
        above = (place - 1) >> 1
        if keys[above] <= key:
            break
        keys[place], items[place] = keys[above], items[above]
        place = above
    keys[place], items[place] = key, item


@scalar_kernel
def sink(keys, items, size):
    """Take the last of ``size`` entries to the top of a binary heap, and down to where it belongs."""
    size -= 1
    key, item = keys[size], items[size]
    place = 0
    while True:
        below = 2 * place + 1
        if below >= size:
            break
        if below + 1 < size and keys[below + 1] < keys[below]:
            below += 1
        if keys[below] >= key:
            break
        keys[place], items[place] = keys[below], items[below]
        place = below
    keys[place], items[place] = key, item


@scalar_kernel
def _least_to_box(node, cols, box, cells, least):
    """Least cost from a node's middle to a box of squares (first row, last row, first col, last col)."""
    row, col = node // cols, node % cols
    down = max(box[0] - row, row - box[1], 0) * cells[1]
    across = max(box[2] - col, col - box[3], 0) * cells[0]
    return least * math.sqrt(down * down + across * across)


@scalar_kernel
def search(field, moves, starts, start_costs, goals, goal_costs, greed):
    """(cost, nodes from start to goal) of the cheapest way over ``moves`` (m, 2) of rows and cols; inf and none.

    starts, goals: (n,) int64 nodes; their costs: what it takes from the true start to the middle, and on from there.
    greed: what is ahead counts so many times; above 1 some way is found sooner, that may cost up to so much more.
    """
    cells, least = field[4], field[5][0] * greed
    rows, cols = field[1].shape
    known = np.full(rows * cols, math.inf)
    before = np.full(rows * cols, -1, np.int64)
    closed = np.zeros(rows * cols, np.uint8)
    ending = np.full(rows * cols, math.inf, np.float32)
    box = (rows, -1, cols, -1)
    cheapest_end = math.inf
    for i in range(goals.shape[0]):
        node = goals[i]
        ending[node] = min(ending[node], goal_costs[i])
        cheapest_end = min(cheapest_end, goal_costs[i])
        r, c = node // cols, node % cols
        box = (min(box[0], r), max(box[1], r), min(box[2], c), max(box[3], c))
    keys, items = np.empty(4096), np.empty(4096, np.int64)
    size = 0
    for i in range(starts.shape[0]):
        node = starts[i]
        if start_costs[i] < known[node]:
            known[node] = start_costs[i]
            if size == keys.shape[0]:
                keys, items = np.append(keys, np.empty(size)), np.append(items, np.empty(size, np.int64))
            keys[size], items[size] = start_costs[i] + _least_to_box(node, cols, box, cells, least), node
            lift(keys, items, size)
            size += 1
    best, last = math.inf, -1
    while size > 0 and keys[0] + cheapest_end < best:
        node = items[0]
        sink(keys, items, size)
        size -= 1
        if closed[node]:
            continue
        closed[node] = 1
        if known[node] + ending[node] < best:
            best, last = known[node] + ending[node], node
        row, col = node // cols, node % cols
        for m in range(moves.shape[0]):
            r, c = row + moves[m, 0], col + moves[m, 1]
            if not (0 <= r < rows and 0 <= c < cols) or field[1][r, c] != 1:
                continue
            there = r * cols + c
            if closed[there]:
                continue
            if abs(r - row) <= 1 and abs(c - col) <= 1:
                step = step_cost(field, row, col, r, c)
            else:
                step = segment_cost(field, row + 0.5, col + 0.5, r + 0.5, c + 0.5)[1]
            if known[node] + step < known[there]:
                known[there] = known[node] + step
                before[there] = node
                if size == keys.shape[0]:
                    keys, items = np.append(keys, np.empty(size)), np.append(items, np.empty(size, np.int64))
                keys[size] = known[there] + _least_to_box(there, cols, box, cells, least)
                items[size] = there
                lift(keys, items, size)
                size += 1
    length = 0
    node = last
    while node >= 0:
        length += 1
        node = before[node]
    nodes = np.empty(length, np.int64)
    node = last
    for i in range(length - 1, -1, -1):
        nodes[i] = node
        node = before[node]
    return best, nodes


@scalar_kernel
def costs_from(field, starts, start_costs):
    """(rows · cols,) cost of the cheapest way over the eight neighbours from any start to each node; +inf = none."""
    rows, cols = field[1].shape
    known = np.full(rows * cols, math.inf)
    closed = np.zeros(rows * cols, np.uint8)
    keys, items, size = np.empty(4096), np.empty(4096, np.int64), 0
    for i in range(starts.shape[0]):
        known[starts[i]] = min(known[starts[i]], start_costs[i])
        if size == keys.shape[0]:
            keys, items = np.append(keys, np.empty(size)), np.append(items, np.empty(size, np.int64))
        keys[size], items[size] = start_costs[i], starts[i]
        lift(keys, items, size)
        size += 1
    while size > 0:
        node = items[0]
        sink(keys, items, size)
        size -= 1
        if closed[node]:
            continue
        closed[node] = 1
        row, col = node // cols, node % cols
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            for c in range(max(col - 1, 0), min(col + 2, cols)):
                there = r * cols + c
                if closed[there] or field[1][r, c] != 1:
                    continue
                found = known[node] + step_cost(field, row, col, r, c)
                if found < known[there]:
                    known[there] = found
                    if size == keys.shape[0]:
                        keys, items = np.append(keys, np.empty(size)), np.append(items, np.empty(size, np.int64))
                    keys[size], items[size] = found, there
                    lift(keys, items, size)
                    size += 1
    return known
