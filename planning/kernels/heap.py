"""A binary heap of keys with an item each, the least key on top; and the way back over what a search came from."""

import numpy as np

from compiled.options import scalar_kernel

__all__ = ["doubled", "pop", "push", "way_to"]


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
