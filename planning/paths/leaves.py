"""Triangles of the ground, split where it matters: which touch which, which hold a place, ways over them.

The ground is two triangles for each square of four posts, and each of them splits in sixteen of its own shape, which
lie over the same plane. A leaf is a triangle that is not split further: (level, row, col, half); its square is one of
a grid 4**level times as fine, and half 0 lies west of the square's diagonal, 1 east of it.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from planning.kernels.searches import cheapest_nodes
from planning.questions.problems import FlightProblem

__all__ = ["SPLIT", "Graph", "Leaves", "surely_shut"]

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

# a side is split in so many
SPLIT = 4
# a place this near a line between leaves is on it, in cells
ON_LINE = 1e-9
# (down, across) from a square of each half to the squares beyond its sides; there the other half is the neighbour
BEYOND = (((0, -1), (1, 0), (0, 0)), ((0, 1), (-1, 0), (0, 0)))
# corners of each half in its square, (row, col)
CORNERS = np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (0, 1), (1, 1)]], np.float64)
_PARTS = [(i, j, half) for i in range(SPLIT) for j in range(SPLIT) for half in (0, 1)]
# (row, col, half) of the parts of each half
CHILDREN = tuple(
    np.array([(i, j, h) for i, j, h in _PARTS if (half if i == j else int(i < j)) == half and (i != j or h == half)])
    for half in (0, 1)
)


@dataclass(frozen=True, eq=False, slots=True)
class Leaves:
    """n leaves over (rows, cols) squares of posts; level, row, col, half: (n,)."""

    shape: tuple[int, int]
    level: Ints
    row: Ints
    col: Ints
    half: Ints

    @classmethod
    def whole(cls, shape: tuple[int, int]) -> Leaves:
        """Every triangle of the ground, in the order of (rows, cols, 2)."""
        row, col, half = (axis.ravel() for axis in np.indices((*shape, 2)))
        return cls(shape, np.zeros(len(row), np.int64), row, col, half)

    def __len__(self) -> int:
        """Number of leaves."""
        return len(self.level)

    def some(self, which: Mask | Ints) -> Leaves:
        """Those that are marked or numbered."""
        return Leaves(self.shape, self.level[which], self.row[which], self.col[which], self.half[which])

    def and_those(self, others: Leaves) -> Leaves:
        """These, then others."""
        pairs = ((getattr(self, name), getattr(others, name)) for name in ("level", "row", "col", "half"))
        return Leaves(self.shape, *(np.concatenate(pair) for pair in pairs))

    @property
    def size(self) -> Floats:
        """(n,) side of the leaf's square, in cells."""
        side: Floats = float(SPLIT) ** -self.level.astype(np.float64)
        return side

    @property
    def corners(self) -> Floats:
        """(n, 3, 2) fractional posts (row, col), exact."""
        at = np.stack([self.row, self.col], axis=1)[:, None, :] + CORNERS[self.half]
        exact: Floats = at * self.size[:, None, None]
        return exact

    @property
    def middles(self) -> Floats:
        """(n, 2) fractional posts of their centres of gravity."""
        middle: Floats = self.corners.mean(axis=1)
        return middle

    @property
    def triangle(self) -> tuple[Ints, Ints, Ints]:
        """(row, col, half), each (n,), of the triangle of the ground that each is part of."""
        fine = SPLIT**self.level
        down, across = self.row % fine, self.col % fine
        return self.row // fine, self.col // fine, _half(down, across, self.half)

    def split(self) -> Leaves:
        """The sixteen parts of each."""
        found = []
        for half in (0, 1):
            of = self.some(self.half == half)
            parts = CHILDREN[half]
            row, col = (SPLIT * axis[:, None] + parts[:, n] for n, axis in enumerate((of.row, of.col)))
            level = np.repeat(of.level + 1, len(parts))
            found.append(Leaves(self.shape, level, row.ravel(), col.ravel(), np.tile(parts[:, 2], len(of))))
        return found[0].and_those(found[1])

    def hold(self, places: Floats) -> Mask:
        """(n, k) whether each leaf has its places, (n, k, 2) or (1, k, 2), in it or on its border."""
        size = self.size[:, None]
        down, across = places[..., 0] - self.row[:, None] * size, places[..., 1] - self.col[:, None] * size
        inside = (down >= -ON_LINE) & (down <= size + ON_LINE) & (across >= -ON_LINE) & (across <= size + ON_LINE)
        inside &= np.where(self.half[:, None] == 0, down - across, across - down) >= -ON_LINE
        return inside

    def sides(self) -> Ints:
        """(m, 2) numbers of leaves that have a piece of a side in common."""
        levels = np.unique(self.level).tolist()
        tables = {level: self._table(level) for level in levels}
        found = []
        for level in levels:
            of = np.flatnonzero(self.level == level)
            for side in range(3):
                step = np.array([BEYOND[0][side], BEYOND[1][side]])[self.half[of]]
                row, col, half = self.row[of] + step[:, 0], self.col[of] + step[:, 1], 1 - self.half[of]
                open_ends, at_level = of, level
                while len(open_ends):
                    there = tables[at_level](row, col, half) if at_level in tables else np.full(len(row), -1)
                    hit = there >= 0
                    if at_level == level:
                        # both of two of one size find each other: the western one is asked
                        pair = hit & (half == 1)
                        found.append(np.column_stack([open_ends[pair], there[pair]]))
                    else:
                        found.append(np.column_stack([open_ends[hit], there[hit]]))
                    if at_level == 0:
                        break
                    left = ~hit
                    open_ends, row, col, half = open_ends[left], row[left], col[left], half[left]
                    half = _half(row % SPLIT, col % SPLIT, half)
                    row, col, at_level = row // SPLIT, col // SPLIT, at_level - 1
        return np.concatenate(found) if found else np.zeros((0, 2), np.int64)

    def _table(self, level: int) -> _Table:
        of = np.flatnonzero(self.level == level)
        fine = SPLIT**level
        shape = self.shape[0] * fine, self.shape[1] * fine
        keys = (self.row[of] * shape[1] + self.col[of]) * 2 + self.half[of]
        if level == 0:
            numbers = np.full(2 * shape[0] * shape[1], -1, np.int64)
            numbers[keys] = of
            return _Table(shape, None, numbers)
        order = np.argsort(keys)
        return _Table(shape, keys[order], of[order])


@dataclass(frozen=True, eq=False, slots=True)
class _Table:
    """Numbers of leaves of one level by their places; keys: None = there is a number for each place."""

    shape: tuple[int, int]
    keys: Ints | None
    numbers: Ints

    def __call__(self, row: Ints, col: Ints, half: Ints) -> Ints:
        """(n,) the leaf at each place; -1 = none."""
        inside = (row >= 0) & (row < self.shape[0]) & (col >= 0) & (col < self.shape[1])
        wanted = np.where(inside, (row * self.shape[1] + col) * 2 + half, 0)
        if self.keys is None:
            return np.where(inside, self.numbers[wanted], -1)
        at = np.minimum(np.searchsorted(self.keys, wanted), len(self.keys) - 1)
        return np.where(inside & (self.keys[at] == wanted), self.numbers[at], -1)


def _half(down: Ints, across: Ints, half: Ints) -> Ints:
    """The half of a square in which a part of it lies; on the diagonal its own."""
    return np.where(down == across, half, (down < across).astype(np.int64))


@dataclass(frozen=True, eq=False)
class Graph:
    """count nodes, and edges (m, 2) between them."""

    count: int
    edges: Ints

    def labels(self) -> Ints:
        """(count,) number of the part that each node is in."""
        ones = np.ones(len(self.edges), np.int8)
        matrix = scipy.sparse.coo_array((ones, (self.edges[:, 0], self.edges[:, 1])), (self.count, self.count))
        found: Ints = scipy.sparse.csgraph.connected_components(matrix, directed=False)[1]
        return found

    def among(self, kept: Mask) -> Graph:
        """With the edges alone whose ends are both kept."""
        return Graph(self.count, self.edges[kept[self.edges].all(axis=1)])

    def cheapest(self, costs: Floats, starts: Ints, goals: Ints, *, by_worst: bool = False) -> tuple[float, Ints]:
        """(cost, nodes) of the cheapest way, with costs (m,) of the edges; see ``cheapest_nodes``."""
        both = np.concatenate([self.edges, self.edges[:, ::-1]])
        order = np.argsort(both[:, 0], kind="stable")
        first = np.searchsorted(both[order, 0], np.arange(self.count + 1))
        cost, nodes = cheapest_nodes(first, both[order, 1].copy(), np.tile(costs, 2)[order], starts, goals, by_worst)
        return float(cost), nodes


def surely_shut(problem: FlightProblem) -> bool:
    """Whether start and goal are parted by lines of the triangulation that cannot be crossed at any altitude.

    Over a place the air begins a bubble above its ground at least, however far the ground beside it is.
    """
    grid, heights_m = problem.grid, problem.grid.heights_m.astype(np.float64)
    lowest, highest = [heights_m + problem.bubble_m], [np.full(grid.shape, problem.ceiling_m)]
    if problem.ceiling_above_ground:
        highest[0] = highest[0] + heights_m
    if problem.above is not None:
        above = problem.above
        lowest.append(above.safe_above_m.astype(np.float64))
        highest.append(
            heights_m + above.ceiling_m if above.ceiling_above_ground else highest[0] * 0.0 + above.ceiling_m
        )
    # what is over unknown ground is shut, and so is what has no safe altitude, all along a line that ends there
    rooms = [np.nan_to_num(top - low, nan=-np.inf) for low, top in itertools.product(lowest, highest)]
    rows, cols = grid.rows - 1, grid.cols - 1
    west = 2 * np.arange(rows * cols).reshape(rows, cols)
    east = west + 1
    edges = [
        _open((west, east), rooms, (slice(None, -1), slice(None, -1)), (slice(1, None), slice(1, None))),
        _open((east[:, :-1], west[:, 1:]), rooms, (slice(None, -1), slice(1, -1)), (slice(1, None), slice(1, -1))),
        _open((west[:-1], east[1:]), rooms, (slice(1, -1), slice(None, -1)), (slice(1, -1), slice(1, None))),
    ]
    parts = Graph(2 * rows * cols, np.concatenate(edges)).labels()
    begin, end = (parts[_over(problem, place)] for place in (problem.start, problem.goal))
    return not np.isin(begin, end).any()


def _open(
    pair: tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]],
    rooms: list[Floats],
    one: tuple[slice, slice],
    other: tuple[slice, slice],
) -> npt.NDArray[np.int64]:
    """(m, 2) triangles whose common lines, between posts one and other, may have air somewhere.

    Room between two surfaces is linear along a line, so it is greatest at one of its ends.
    """
    crossed = np.ones(pair[0].shape, np.bool_)
    for room_m in rooms:
        crossed &= np.maximum(room_m[one], room_m[other]) >= 0.0
        crossed &= np.isfinite(room_m[one]) & np.isfinite(room_m[other])
    return np.column_stack([side[crossed] for side in pair])


def _over(problem: FlightProblem, place: tuple[float, float, float]) -> npt.NDArray[np.int64]:
    """Triangles over which a place may be."""
    row, col = problem.grid.post_at(place[0], place[1])
    rows, cols = problem.grid.rows - 1, problem.grid.cols - 1
    top, left = min(max(int(row), 0), rows - 1), min(max(int(col), 0), cols - 1)
    return np.array([2 * (top * cols + left), 2 * (top * cols + left) + 1])
