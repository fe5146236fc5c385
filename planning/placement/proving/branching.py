"""Best first through the sets of candidates, until what is left cannot be better or the work is done."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from planning.placement.judges import Judge
from planning.placement.together import Together

from .relaxation import ROUNDING, Parts, Relaxation
from .subgradients import Bounds, Node, bounds_of

__all__ = ["Proof", "prove"]

# multiplications a second of two cores, about: a budget that no clock decides gives the same answer on any machine
PER_SECOND = 5e9
AT_ONCE = 24
ROUNDS_AT_ROOT, ROUNDS = 200, 16


@dataclass(frozen=True, slots=True)
class Proof:
    """A set at least as good as the one that was given, and the value that none exceeds.

    proved: no set is better, by more than a millionth where targets count differently. nodes: how many were looked at.
    """

    chosen: list[int]
    value: float
    bound: float
    proved: bool
    nodes: int


@dataclass(slots=True, eq=False)
class _Tree:
    """What the search has come to. open: nodes by their bounds, largest first; seen: how many there were."""

    chosen: list[int]
    value: float
    margin: float
    open: list[tuple[float, int, Node]] = field(default_factory=list)
    seen: int = 0

    @property
    def floor(self) -> float:
        """What a bound has to exceed to be worth a look."""
        return self.value + self.margin

    def put(self, bound: float, node: Node) -> None:
        """Leave a node for later where it may hold something better."""
        if bound > self.floor:
            self.seen += 1
            heapq.heappush(self.open, (-bound, self.seen, node))

    def offer(self, chosen: list[int], judge: Judge) -> None:
        """Keep a set that is better."""
        value = judge.value(chosen)
        if value > self.value + ROUNDING * abs(self.value) * 1e-3:
            self.chosen, self.value = chosen, value


def prove(
    rows: Relaxation,
    judge: Judge,
    chosen: list[int],
    together: Together,
    effort_s: float,
    stop: Callable[[], bool] | None = None,
) -> Proof:
    """How good a set is: a better one where there is, and a value that no set of as many candidates exceeds.

    effort_s: seconds of two cores, about, that are spent at most; the best first, so that the bound falls all the time.
    """
    count = len(chosen)
    value = judge.value(chosen)
    margin = max(0.5 * rows.unit, ROUNDING)
    tree = _Tree(list(chosen), value, margin)
    if not len(rows.weight):
        return Proof(tree.chosen, value, max(value, rows.base), rows.base <= value, 0)
    by_rank = np.sort(rows.part, axis=0)[::-1][:count]
    most: list[Parts] = [np.zeros_like(rows.need), *np.cumsum(by_rank, axis=0)]
    each = 2.0 * rows.part.size
    everyone = Node((), np.flatnonzero(together.may_join([])), count, np.full(rows.need.shape, 0.5, np.float16))
    work = each * ROUNDS_AT_ROOT
    root = bounds_of(rows, most, [everyone], value, ROUNDS_AT_ROOT)
    _branch(rows, tree, judge, together, everyone, root, 0)
    while tree.open and work < effort_s * PER_SECOND and not (stop is not None and stop()):
        nodes: list[Node] = []
        # no more than the work that is left pays for
        most_nodes = min(AT_ONCE, 1 + int((effort_s * PER_SECOND - work) / (each * ROUNDS)))
        while tree.open and len(nodes) < most_nodes:
            bound, _, node = heapq.heappop(tree.open)
            if -bound > tree.floor:
                nodes.append(node)
        pairs = [node for node in nodes if node.left == 2 and rows.whole]
        for node in pairs:
            work += _best_pair(rows, tree, judge, together, node)
        rest = [node for node in nodes if not (node.left == 2 and rows.whole)]
        if rest:
            found = bounds_of(rows, most, rest, tree.value, ROUNDS)
            work += each * ROUNDS * len(rest)
            for at, node in enumerate(rest):
                _branch(rows, tree, judge, together, node, found, at)
    left = max((-bound for bound, _, _ in tree.open), default=-np.inf)
    proved = left <= tree.floor
    return Proof(tree.chosen, tree.value, tree.value if proved else left, proved, tree.seen)


def _branch(
    rows: Relaxation, tree: _Tree, judge: Judge, together: Together, node: Node, bounds: Bounds, at: int
) -> None:
    """Put the sets of a node that may be better into the tree, by the member that gains most among those left."""
    bound, base = float(bounds.bound[at]), float(bounds.base[at])
    if bound <= tree.floor:
        return
    if len(node.allowed) < node.left:
        return
    gain = bounds.gain[at][node.allowed]
    order = np.argsort(-gain, kind="stable")
    allowed, gain = node.allowed[order], gain[order]
    if node.left == 1:
        # the gains are those of the relaxation: the judge has the last word
        values = judge.with_each(list(node.members), allowed)
        tree.offer([*node.members, int(allowed[np.argmax(values)])], judge)
        return
    summed = np.concatenate([[0.0], np.cumsum(gain)])
    others = node.left - 1
    # in the place of the last of the best, each further one
    alone = base + gain + np.where(np.arange(len(gain)) < others, summed[node.left] - gain, summed[others])
    kept = np.flatnonzero(alone + ROUNDING > tree.floor)
    allowed, gain = allowed[kept], gain[kept]
    if len(gain) < node.left:
        return
    summed = np.concatenate([[0.0], np.cumsum(gain)])
    price = bounds.price[at].astype(np.float16)
    for first in range(len(gain) - others):
        least = min(bound, base + float(summed[first + node.left] - summed[first]) + ROUNDING)
        if least <= tree.floor:
            break
        members = (*node.members, int(allowed[first]))
        following = allowed[first + 1 :]
        if together.separated:
            following = following[together.may_join(list(members))[following]]
        tree.put(least, Node(members, following, others, price))


def _best_pair(rows: Relaxation, tree: _Tree, judge: Judge, together: Together, node: Node) -> float:
    """Go through all pairs that complete a node; the multiplications that it took."""
    need = rows.need[0] - rows.part[list(node.members), 0].sum(axis=0)
    open_rows = np.flatnonzero((need > 0.5) & (need < 2.5))
    one = (need[open_rows] < 1.5).astype(np.float32)
    part = rows.part[:, 0][np.ix_(node.allowed, open_rows)]
    weight = rows.weight[open_rows].astype(np.float32)
    alone = part @ (weight * one)
    both = (part * (weight * (1.0 - 2.0 * one))) @ part.T
    value = alone[:, None] + alone[None, :] + both
    value[np.tril_indices(len(value))] = -np.inf
    if together.separated:
        for row, member in enumerate(node.allowed.tolist()):
            value[row, ~together.may_join([member])[node.allowed]] = -np.inf
    if value.size and np.isfinite(value).any():
        first, second = divmod(int(np.argmax(value)), len(value))
        tree.offer([*node.members, int(node.allowed[first]), int(node.allowed[second])], judge)
    return 2.0 * part.size * (len(part) + 1)
