"""Cheapest ways over the squares of a field, over squares by their worst alone, and over any graph; and their heap.

A node of a field is a square, numbered row · cols + col; its place is its middle. See path_segments for what a field
is.
"""

import math

import numpy as np

from compiled.options import scalar_kernel

from .path_segments import segment_cost, step_cost

__all__ = ["cheapest_nodes", "costs_from", "doubled", "least_worst_way", "pop", "push", "search", "way_to"]

ROOM = 4096  # of a heap at first


@scalar_kernel
def doubled(keys, items):
    """The same two arrays with room for as many entries again."""
    size = keys.shape[0]
    return np.append(keys, np.empty(size)), np.append(items, np.empty(size, np.int64))


@scalar_kernel
def push(keys, items, size, key, item):
    """Put an entry into a heap of ``size`` entries that has room for it; its size then."""
    place = size
    while place > 0:
        above = (place - 1) >> 1
        if keys[above] <= key:
            break
        keys[place], items[place] = keys[above], items[above]
        place = above
    keys[place], items[place] = key, item
    return size + 1


@scalar_kernel
def pop(keys, items, size):
    """(item of the least key of ``size`` entries, size without it): the last goes to the top, and down from there."""
    least = items[0]
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
    return least, size


@scalar_kernel
def way_to(last, before):
    """The nodes that lead to a node, itself the last; before: where each was come from, -1 = it is a start."""
    length, node = 0, last
    while node >= 0:
        length += 1
        node = before[node]
    nodes, node = np.empty(length, np.int64), last
    for i in range(length - 1, -1, -1):
        nodes[i] = node
        node = before[node]
    return nodes


@scalar_kernel
def _least_to_box(node, cols, box, cells, least):
    """Least cost from a node's middle to a box of squares (first row, last row, first col, last col)."""
    first_row, last_row, first_col, last_col = box
    row, col = node // cols, node % cols
    down = max(first_row - row, row - last_row, 0) * cells.north_m
    across = max(first_col - col, col - last_col, 0) * cells.east_m
    return least * math.sqrt(down * down + across * across)


@scalar_kernel
def search(field, moves, starts, start_costs, goals, goal_costs, greed):
    """(cost, nodes from start to goal) of the cheapest way over ``moves`` (m, 2) of rows and cols; inf and none.

    starts, goals: (n,) int64 nodes; their costs: what it takes from the true start to the middle, and on from there.
    greed: what is ahead counts so many times; above 1 some way is found sooner, that may cost up to so much more.
    """
    cells, least = field.cells, field.rates.least_per_m * greed
    rows, cols = field.allowed.shape
    known = np.full(rows * cols, math.inf)
    before = np.full(rows * cols, -1, np.int64)
    closed = np.zeros(rows * cols, np.uint8)
    ending = np.full(rows * cols, math.inf, np.float32)
    first_row, last_row, first_col, last_col = rows, -1, cols, -1
    cheapest_end = math.inf
    for i in range(goals.shape[0]):
        node = goals[i]
        ending[node] = min(ending[node], goal_costs[i])
        cheapest_end = min(cheapest_end, goal_costs[i])
        r, c = node // cols, node % cols
        first_row, last_row = min(first_row, r), max(last_row, r)
        first_col, last_col = min(first_col, c), max(last_col, c)
    box = (first_row, last_row, first_col, last_col)
    keys, items, size = np.empty(ROOM), np.empty(ROOM, np.int64), 0
    for i in range(starts.shape[0]):
        node = starts[i]
        if start_costs[i] < known[node]:
            known[node] = start_costs[i]
            if size == keys.shape[0]:
                keys, items = doubled(keys, items)
            size = push(keys, items, size, start_costs[i] + _least_to_box(node, cols, box, cells, least), node)
    best, last = math.inf, -1
    while size > 0 and keys[0] + cheapest_end < best:
        node, size = pop(keys, items, size)
        if closed[node]:
            continue
        closed[node] = 1
        if known[node] + ending[node] < best:
            best, last = known[node] + ending[node], node
        row, col = node // cols, node % cols
        for m in range(moves.shape[0]):
            r, c = row + moves[m, 0], col + moves[m, 1]
            if not (0 <= r < rows and 0 <= c < cols) or field.allowed[r, c] != 1:
                continue
            there = r * cols + c
            if closed[there]:
                continue
            if abs(r - row) <= 1 and abs(c - col) <= 1:
                step = step_cost(field, row, col, r, c)
            else:
                _, step, _, _, _, _ = segment_cost(field, row + 0.5, col + 0.5, r + 0.5, c + 0.5)
            if known[node] + step < known[there]:
                known[there] = known[node] + step
                before[there] = node
                if size == keys.shape[0]:
                    keys, items = doubled(keys, items)
                size = push(keys, items, size, known[there] + _least_to_box(there, cols, box, cells, least), there)
    return best, way_to(last, before)


@scalar_kernel
def costs_from(field, ends, end_costs, onto):
    """(cost, neighbour), each (rows · cols,): the cheapest way over the eight neighbours from any end to each node.

    onto: from each node to any end instead. neighbour: the one before the node on that way, with onto the one after it;
    -1 = it is an end, or there is no way, which costs +inf.
    """
    rows, cols = field.allowed.shape
    known = np.full(rows * cols, math.inf)
    beside = np.full(rows * cols, -1, np.int64)
    closed = np.zeros(rows * cols, np.uint8)
    keys, items, size = np.empty(ROOM), np.empty(ROOM, np.int64), 0
    for i in range(ends.shape[0]):
        known[ends[i]] = min(known[ends[i]], end_costs[i])
        if size == keys.shape[0]:
            keys, items = doubled(keys, items)
        size = push(keys, items, size, end_costs[i], ends[i])
    while size > 0:
        node, size = pop(keys, items, size)
        if closed[node]:
            continue
        closed[node] = 1
        row, col = node // cols, node % cols
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            for c in range(max(col - 1, 0), min(col + 2, cols)):
                there = r * cols + c
                if closed[there] or field.allowed[r, c] != 1:
                    continue
                step = step_cost(field, r, c, row, col) if onto else step_cost(field, row, col, r, c)
                found = known[node] + step
                if found < known[there]:
                    known[there], beside[there] = found, node
                    if size == keys.shape[0]:
                        keys, items = doubled(keys, items)
                    size = push(keys, items, size, found, there)
    return known, beside


@scalar_kernel
def _worst_of_step(value, row, col, r, c):
    """The worst square that a step from one square to a neighbour touches: all four around a post that it passes."""
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
    worst, steps = np.full(rows * cols, math.inf), np.zeros(rows * cols, np.int64)
    before = np.full(rows * cols, -1, np.int64)
    closed, ending = np.zeros(rows * cols, np.uint8), np.zeros(rows * cols, np.uint8)
    for node in goals:
        ending[node] = 1
    keys, items, size = np.empty(ROOM), np.empty(ROOM, np.int64), 0
    for node in starts:
        at = value[node // cols, node % cols]
        if at < worst[node]:
            worst[node] = at
            if size == keys.shape[0]:
                keys, items = doubled(keys, items)
            size = push(keys, items, size, at, node)
    while size > 0:
        node, size = pop(keys, items, size)
        if closed[node]:
            continue
        closed[node] = 1
        if ending[node]:
            return worst[node], way_to(node, before)
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
                        keys, items = doubled(keys, items)
                    size = push(keys, items, size, found, there)
    return math.inf, np.empty(0, np.int64)


@scalar_kernel
def cheapest_nodes(first, others, costs, starts, goals, by_worst):
    """(cost, nodes) of the cheapest way from any start to any goal; inf and no nodes where there is none.

    first: (n + 1,) where each node's edges begin in others (m,), the nodes at their far ends, and costs (m,) float64.
    by_worst: a way costs as much as its dearest edge, and of equal ones the one of fewer edges is taken; else the sum.
    """
    count = first.shape[0] - 1
    known, steps = np.full(count, math.inf), np.zeros(count, np.int64)
    before, closed = np.full(count, -1, np.int64), np.zeros(count, np.uint8)
    ending = np.zeros(count, np.uint8)
    for node in goals:
        ending[node] = 1
    keys, items, size = np.empty(ROOM), np.empty(ROOM, np.int64), 0
    for node in starts:
        if known[node] == math.inf:
            known[node] = -math.inf if by_worst else 0.0
            if size == keys.shape[0]:
                keys, items = doubled(keys, items)
            size = push(keys, items, size, known[node], node)
    while size > 0:
        node, size = pop(keys, items, size)
        if closed[node]:
            continue
        closed[node] = 1
        if ending[node]:
            return known[node], way_to(node, before)
        for edge in range(first[node], first[node + 1]):
            there = others[edge]
            if closed[there]:
                continue
            found = max(known[node], costs[edge]) if by_worst else known[node] + costs[edge]
            if found == math.inf:
                continue
            shorter = by_worst and found == known[there] and steps[node] + 1 < steps[there]
            if found < known[there] or shorter:
                known[there], before[there], steps[there] = found, node, steps[node] + 1
                if size == keys.shape[0]:
                    keys, items = doubled(keys, items)
                size = push(keys, items, size, found, there)
    return math.inf, np.empty(0, np.int64)
