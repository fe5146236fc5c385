"""Columns of air seen by distant anchors alone: their directions are the same at all altitudes.

So a dilution depends on the visible set only. Going up, anchors only join, and no dilution gets worse by one more.
Each column therefore has one altitude from which it is flyable, that of the anchor whose joining brings the dilution
below the limit, and it is found by halving the anchors in the order of their lowest altitudes.
"""

import math

import numpy as np

from compiled.options import scalar_kernel
from visibility.air.kernels.columns import ABOVE, EVERYWHERE, MAYBE, NOWHERE, SURE, UNKNOWN, Column
from visibility.dilution.kernels.dop import dilutions

__all__ = ["solve_distant"]

ANYWHERE = (0.0, 0.0, 0.0)


@scalar_kernel
def _ascending(lowest, ceiling, order):
    """Fill order with the anchors in sight below the ceiling, by ascending lowest altitude; returns how many."""
    count = 0
    for a in range(lowest.shape[0]):
        if not lowest[a] < ceiling:
            continue
        at = count
        while at > 0 and lowest[order[at - 1]] > lowest[a]:
            order[at] = order[at - 1]
            at -= 1
        order[at] = a
        count += 1
    return count


@scalar_kernel
def _flyable_from(lowest, ceiling, order, words, question):
    """Altitude from which the air is flyable; +inf where it is not at the ceiling."""
    sources, kind, measure = question.sources, question.kind, question.measure
    seen = _ascending(lowest, ceiling, order)
    few, most = question.needed - 1, seen + 1  # anchors that do not suffice; that do, or one more than there are
    while most - few > 1:
        count = (few + most) // 2
        for word in range(words.shape[0]):
            words[word] = np.uint64(0)
        for rank in range(count):
            a = order[rank]
            words[a >> 6] |= np.uint64(1) << np.uint64(a & 63)
        value, _ = dilutions(ANYWHERE, sources, words, kind, measure)
        if value < question.limit:
            most = count
        else:
            few = count
    return lowest[order[most - 1]] if most <= seen else math.inf


@scalar_kernel
def solve_distant(table, scratch, air, question, known):
    """The Column over one post.

    air: (ground, ceiling); scratch: (order (anchors,) int64, words (w,) uint64); question: a Question (columns).
    """
    order, words = scratch
    ground, ceiling = air
    sure = _flyable_from(table[SURE], ceiling, order, words, question)
    if sure <= ground:
        return Column(ground, ground, EVERYWHERE, 0)
    maybe = sure if known else _flyable_from(table[MAYBE], ceiling, order, words, question)
    intervals = 1 if maybe > ground else 0
    if maybe < sure:
        return Column(math.nan, sure, UNKNOWN, intervals)
    if math.isinf(sure):
        return Column(math.nan, math.inf, NOWHERE, intervals)
    return Column(sure, sure, ABOVE, intervals)
