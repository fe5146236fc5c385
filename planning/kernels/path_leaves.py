"""The cheapest way over a graph whose edges lie one after the other, node by node."""

import math

import numpy as np

from compiled.options import scalar_kernel

from .path_grid import lift, sink

__all__ = ["cheapest_nodes"]


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
    keys, items, size = np.empty(4096), np.empty(4096, np.int64), 0
    for node in starts:
        if known[node] == math.inf:
            known[node] = -math.inf if by_worst else 0.0
            if size == keys.shape[0]:
                keys, items = np.append(keys, np.empty(size)), np.append(items, np.empty(size, np.int64))
            keys[size], items[size] = known[node], node
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
                    keys, items = np.append(keys, np.empty(size)), np.append(items, np.empty(size, np.int64))
                keys[size], items[size] = found, there
                lift(keys, items, size)
                size += 1
    if last < 0:
        return math.inf, np.empty(0, np.int64)
    cost, length, node = known[last], 0, last
    while node >= 0:
        length += 1
        node = before[node]
    nodes, node = np.empty(length, np.int64), last
    for i in range(length - 1, -1, -1):
        nodes[i] = node
        node = before[node]
    return cost, nodes
