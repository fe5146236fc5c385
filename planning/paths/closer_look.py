"""A way where the squares of the field have none, or the proof that there is none, by splitting what is in doubt.

Two questions are asked of the same triangles: whether those that are everywhere allowed join start and goal, which is a
way; and whether those that may be allowed somewhere do, for if they do not there is none. What is in doubt between is
split, until one of the two is answered or the budget is used up.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy
import shapely

from planning.questions.problems import Goal, Place

from .corridors import drop_repeats
from .judging import CLEAR, CLOSED, DOUBT, FINAL, SLIVER, Judge
from .leaves import Graph, Leaves
from .places import metres_of

__all__ = ["CloserLook", "Look"]

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
Point = tuple[float, float]

# work that is done at most: rounds of splitting, leaves that are split in one of them and that there are in all
MOST_ROUNDS, MOST_AT_ONCE, MOST_LEAVES = 64, 20_000, 6_000_000
# and rounds where only a way can come of it
MOST_WITHOUT_PROOF = 6
# leaves are split on ways through up to so many times as much doubt as the one through least
AS_MUCH = 1.5
# what doubt counts for in this that cannot be split
HOPELESS = 16.0
# what a metre over a square that the field forbids counts more, so that the grid finds most of the way
ASIDE = 4.0
# how far a way stays from the ends of the sides that it crosses, as a share of them
APART = 0.05
TIME_UP = "the time was up before it was searched finely enough"


@dataclass(frozen=True, eq=False, slots=True)
class Look:
    """What a look ended with.

    places: (n, 2) fractional posts of a way over what is everywhere allowed; None = none was found. cut: whether what
    may be allowed does not join start and goal. grain_m: where it is cut, how wide a way through what was too small to
    be split may be at most. why: why neither is known.
    """

    places: Floats | None
    cut: bool
    grain_m: float
    why: str


class CloserLook:
    """One leg of a way, looked at closer and closer."""

    def __init__(self, judge: Judge, begin: Place, goals: tuple[Goal, ...], ended: Callable[[], bool]) -> None:
        self._judge, self._begin, self._goals, self._ended = judge, begin, goals, ended
        self._grain_m = 0.0
        leaves, codes = judge.coarsest()
        self._put(leaves, codes)

    def look(self) -> Look:
        """The way, the proof, or why there is neither."""
        without_proof = 0
        for _ in range(MOST_ROUNDS):
            if self._ended():
                return self._undecided(TIME_UP)
            graph = Graph(len(self._leaves), self._leaves.sides())
            begin, end = self._ends()
            if not (begin.any() and end.any()):
                return self._undecided("a place lies too near to what it has to keep clear of")
            kept = _joining(graph.labels(), begin, end)
            if not kept.any():
                return Look(None, True, self._grain_m, "")
            graph, begin, end = self._keep(graph, kept), begin[kept], end[kept]
            clear = self._codes == CLEAR
            parts = graph.among(clear).labels()
            if _joining(parts, begin & clear, end & clear).any():
                return Look(self._way(graph.among(clear), begin & clear, end & clear), False, 0.0, "")
            chosen = self._chosen(parts, graph, begin, end)
            # joined by what splitting does not change: no proof can come of it any more, at best a way
            settled = clear | (self._codes == FINAL)
            without_proof += bool(_joining(graph.among(settled).labels(), begin & settled, end & settled).any())
            if len(chosen) == 0 or without_proof > MOST_WITHOUT_PROOF:
                return self._undecided("what is left in doubt cannot be decided by searching more finely")
            if len(self._leaves) > MOST_LEAVES:
                break
            if self._ended():
                return self._undecided(TIME_UP)
            self._split(chosen)
        return self._undecided(f"{MOST_ROUNDS} rounds of searching more finely did not decide it")

    def refuse(self, places_m: list[Place]) -> bool:
        """Take what holds places out of what makes ways; whether anything was."""
        before = int((self._codes == CLEAR).sum())
        for place_m in places_m:
            holding = self._leaves.hold(np.array([[self._judge.field.grid.post_at(*place_m)]]))[:, 0]
            self._codes[holding & (self._codes == CLEAR)] = FINAL
        return int((self._codes == CLEAR).sum()) < before

    def _undecided(self, why: str) -> Look:
        return Look(None, False, math.nan, why)

    def _put(self, leaves: Leaves, codes: npt.NDArray[np.uint8]) -> None:
        """Leaves that may be allowed somewhere, and what is too small to be split left out."""
        slivers = codes == SLIVER
        if slivers.any():
            self._grain_m = max(self._grain_m, 2.0 * float(self._judge.reach_m(leaves.some(slivers)).max()))
        open_to_something = (codes != CLOSED) & ~slivers
        self._leaves, self._codes = leaves.some(open_to_something), codes[open_to_something]

    def _keep(self, graph: Graph, kept: Mask) -> Graph:
        """The graph of the leaves that are kept; what cannot be on a way is not looked at again."""
        number = np.cumsum(kept) - 1
        self._leaves, self._codes = self._leaves.some(kept), self._codes[kept]
        edges = graph.edges[kept[graph.edges].all(axis=1)]
        return Graph(int(kept.sum()), number[edges])

    def _ends(self) -> tuple[Mask, Mask]:
        """Which leaves hold the begin, and which hold a goal or some of a goal's area."""
        grid, leaves = self._judge.field.grid, self._leaves
        begin = leaves.hold(np.array([[grid.post_at(*self._begin)]]))[:, 0]
        end = np.zeros(len(leaves), np.bool_)
        for goal in self._goals:
            if isinstance(goal, tuple):
                end |= leaves.hold(np.array([[grid.post_at(*goal)]]))[:, 0]
                continue
            shapely.prepare(goal)
            # what is everywhere allowed ends a way in its middle, what is in doubt anywhere
            middle_in = shapely.intersects_xy(goal, *metres_of(grid, leaves.middles))
            some = np.flatnonzero(self._codes != CLEAR)
            corners = leaves.some(some).corners
            shapes = shapely.polygons(np.stack(metres_of(grid, corners.reshape(-1, 2)), axis=-1).reshape(corners.shape))
            end |= middle_in & (self._codes == CLEAR)
            end[some] |= shapely.intersects(goal, shapes)
        return begin, end

    def _chosen(self, parts: Ints, graph: Graph, begin: Mask, end: Mask) -> Ints:
        """Numbers of the leaves to be split next: those in doubt on ways that lead through little of it.

        parts: (n,) what is everywhere allowed and joined, and each of the other leaves by itself.
        """
        doubt = np.flatnonzero(self._codes == DOUBT)
        weight = np.zeros(int(parts.max()) + 1)
        other = self._codes != CLEAR
        hopeless = np.where(self._codes[other] == FINAL, HOPELESS, 1.0)
        weight[parts[other]] = self._judge.reach_m(self._leaves.some(other)) * hopeless
        pairs = np.unique(np.sort(parts[graph.edges], axis=1), axis=0)
        pairs = pairs[pairs[:, 0] != pairs[:, 1]]
        through = np.zeros(len(doubt))
        for here, there in ((begin, end), (end, begin)):
            # a way that comes back to where it began says nothing of where it has to be split
            some = pairs[~np.isin(pairs, parts[there & ~other]).any(axis=1)]
            costs = 0.5 * weight[some].sum(axis=1)
            matrix = scipy.sparse.csr_array((costs, (some[:, 0], some[:, 1])), (len(weight), len(weight)))
            ends = np.unique(parts[here])
            away = scipy.sparse.csgraph.dijkstra(matrix, directed=False, indices=ends, min_only=True)
            through += away[parts[doubt]]
        order = np.argsort(through, kind="stable")[:MOST_AT_ONCE]
        chosen: Ints = doubt[order[through[order] <= AS_MUCH * through[order[:1]]]]
        return chosen

    def _split(self, chosen: Ints) -> None:
        parts = self._leaves.some(chosen).split()
        codes = self._judge.of(parts)
        others = np.ones(len(self._leaves), np.bool_)
        others[chosen] = False
        self._put(
            self._leaves.some(others).and_those(parts), np.concatenate([self._codes[others], codes]).astype(np.uint8)
        )

    def _apart_m(self, graph: Graph) -> Floats:
        """(m,) metres between the middles of leaves that touch."""
        at_m = np.column_stack(metres_of(self._judge.field.grid, self._leaves.middles))
        apart_m: Floats = np.hypot(*(at_m[graph.edges[:, 0]] - at_m[graph.edges[:, 1]]).T)
        return apart_m

    def _way(self, graph: Graph, begin: Mask, end: Mask) -> Floats:
        """The cheapest way over leaves that are everywhere allowed, pulled tight between their sides."""
        field, leaves = self._judge.field, self._leaves
        weights = self._judge.problem.weights
        row, col, _ = leaves.triangle
        metre = weights.length + weights.time * float(field.pace.min()) + field.added[row, col].astype(np.float64)
        metre *= np.where(field.reasons[row, col] == 0, 1.0, ASIDE)
        costs = self._apart_m(graph) * metre[graph.edges].mean(axis=1)
        _, nodes = graph.cheapest(costs, np.flatnonzero(begin), np.flatnonzero(end))
        over = leaves.some(nodes)
        grid = field.grid
        middles = np.column_stack(metres_of(grid, over.middles))
        first, last = self._begin, self._last(over.some(np.array([len(over) - 1])))
        ends_m = np.stack(metres_of(grid, _sides_between(over).reshape(-1, 2)), axis=-1).reshape(-1, 2, 2)
        ends_m += APART * (ends_m[:, ::-1] - ends_m)
        ahead = np.diff(middles, axis=0)
        aside = ends_m[:, 0] - middles[:-1]
        first_left = ahead[:, 0] * aside[:, 1] - ahead[:, 1] * aside[:, 0] > 0.0
        left = np.where(first_left[:, None], ends_m[:, 0], ends_m[:, 1])
        right = np.where(first_left[:, None], ends_m[:, 1], ends_m[:, 0])
        corners_m = np.array(_tight(first, _points(left), _points(right), last))
        return drop_repeats(np.column_stack(grid.post_at(corners_m[:, 0], corners_m[:, 1])))

    def _last(self, leaf: Leaves) -> Place:
        """Where a way ends in its last leaf."""
        grid = self._judge.field.grid
        for goal in self._goals:
            if isinstance(goal, tuple) and leaf.hold(np.array([[grid.post_at(*goal)]]))[0, 0]:
                return goal
        east_m, north_m = metres_of(grid, leaf.middles)
        return float(east_m[0]), float(north_m[0])


def _joining(labels: Ints, begin: Mask, end: Mask) -> Mask:
    """(n,) which nodes are in a part that has both ends."""
    both = np.intersect1d(labels[begin], labels[end])
    found: Mask = np.isin(labels, both)
    return found


def _sides_between(over: Leaves) -> Floats:
    """(n - 1, 2, 2) fractional posts of the ends of what each leaf has in common with the next."""
    before, after = over.some(np.arange(len(over) - 1)), over.some(np.arange(1, len(over)))
    swap = (after.level > before.level)[:, None, None]
    small, large = np.where(swap, after.corners, before.corners), np.where(swap[:, 0, 0], 0, 1)
    other = Leaves(
        over.shape,
        *(
            np.where(large == 1, getattr(after, name), getattr(before, name))
            for name in ("level", "row", "col", "half")
        ),
    )
    inside = other.hold(small)
    # two of the three corners of the smaller are on the larger
    order = np.argsort(~inside, axis=1, kind="stable")[:, :2]
    return small[np.arange(len(small))[:, None], order]


def _points(places: Floats) -> list[Point]:
    return [(float(x), float(y)) for x, y in places.tolist()]


def _turn(a: Point, b: Point, c: Point) -> float:
    """Positive where c lies right of the line from a to b."""
    return (c[0] - a[0]) * (b[1] - a[1]) - (b[0] - a[0]) * (c[1] - a[1])


def _tight(begin: Point, lefts: list[Point], rights: list[Point], end: Point) -> list[Point]:
    """The shortest way through gates in their order: a funnel that is narrowed gate by gate."""
    lefts, rights = [begin, *lefts, end], [begin, *rights, end]
    found = [begin]
    apex = left = right = begin
    at_left = at_right = number = 0
    while number + 1 < len(lefts):
        number += 1
        new_left, new_right = lefts[number], rights[number]
        if _turn(apex, right, new_right) <= 0.0:
            if apex == right or _turn(apex, left, new_right) > 0.0:
                right, at_right = new_right, number
            else:
                found.append(left)
                apex = right = left
                number = at_right = at_left
                continue
        if _turn(apex, left, new_left) >= 0.0:
            if apex == left or _turn(apex, right, new_left) < 0.0:
                left, at_left = new_left, number
            else:
                found.append(right)
                apex = left = right
                number = at_left = at_right
                continue
    return [*found, end]
