"""Ways over the squares of the field, the corridor around a way, and OMPL warm-started within it.

States are not places but (metres along the way, metres to its right), so that sampling evenly is sampling near the way.
BIT* won over RRT*, Informed RRT* and RRTConnect here, see docs/planning.md.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from planning.kernels.path_segments import segment_cost
from planning.kernels.path_smoothing import pull, relax, way_cost
from planning.kernels.searches import search

from .ends import Ends
from .fields import KernelField
from .places import Cells
from .sampling import State, Tell, box_space, solved

__all__ = [
    "EIGHT",
    "SIXTEEN",
    "Corridor",
    "CorridorTask",
    "Way",
    "cost_of",
    "drop_repeats",
    "grid_way",
    "pieces",
    "straightened",
]

Places = npt.NDArray[np.float64]

EIGHT = np.array([(0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)], np.int64)
SIXTEEN = np.concatenate(
    [EIGHT, [(a * s, b * t) for a, b in ((1, 2), (2, 1)) for s in (1, -1) for t in (1, -1)]]
).astype(np.int64)
# how long straight pieces are made at once, and how far apart places are put to be moved, in cells
WINDOW = 48.0
SPACING = 6.0
# a way is improved in pieces of so many cells: a planner that samples all of a long one has few samples anywhere
PIECE = 64.0


@dataclass(frozen=True, eq=False, slots=True)
class Way:
    """A way over the field: places (n, 2) as fractional posts, and what it costs."""

    places: Places
    cost: float


def cost_of(field: KernelField, places: Places) -> float:
    """Cost of a way; +inf where it may not be driven."""
    return float(way_cost(field, np.ascontiguousarray(places)))


def grid_way(
    field: KernelField, ends: Sequence[Ends], moves: npt.NDArray[np.int64] = EIGHT, greed: float = 1.0
) -> tuple[Way | None, int]:
    """(the cheapest way from middle to middle through all ends, None where there is none; the leg that has none).

    greed: above 1 a way is found sooner, that may cost up to so many times more.
    """
    legs: list[Places] = []
    for leg, (begin, end) in enumerate(itertools.pairwise(ends)):
        cost, nodes = search(field, moves, begin.nodes, begin.costs, end.nodes, end.costs, greed)
        if not np.isfinite(cost):
            return None, leg
        middles = np.column_stack(np.divmod(nodes, field.allowed.shape[1])) + 0.5
        last = end.places[np.flatnonzero(end.nodes == nodes[-1])[0]]
        legs += [begin.places[:1], middles, last[None, :]]
    places = drop_repeats(np.concatenate(legs))
    return Way(places, cost_of(field, places)), -1


def drop_repeats(places: Places) -> Places:
    """Without places that are the one before."""
    keep = np.ones(len(places), np.bool_)
    keep[1:] = (np.diff(places, axis=0) != 0.0).any(axis=1)
    kept: Places = np.ascontiguousarray(places[keep])
    return kept


def straightened(
    field: KernelField,
    way: Way,
    fixed: Sequence[Places] = (),
    rounds: int = 4,
    stop: Callable[[], bool] | None = None,
) -> Way:
    """A way no dearer, of straight pieces: pulled tight, then its corners moved about, in turn.

    fixed: places that stay on the way. Every piece is checked as it is costed.
    """
    best = way
    for number in range(rounds):
        if stop is not None and stop():
            break
        tight = [_tightened(field, piece, 2.0 / (1 + number)) for piece in pieces(best.places, fixed)]
        places = drop_repeats(np.concatenate(tight))
        cost = cost_of(field, places)
        if not cost < best.cost * (1.0 - 1e-4):
            if cost < best.cost:
                best = Way(places, cost)
            break
        best = Way(places, cost)
    return best


def pieces(places: Places, fixed: Sequence[Places]) -> list[Places]:
    """The way cut at the places that stay."""
    cuts, begin = [], 0
    for place in fixed:
        at = begin + int(np.flatnonzero((places[begin:] == place).all(axis=1))[0])
        cuts.append(places[begin : at + 1])
        begin = at
    return [*cuts, places[begin:]]


def _tightened(field: KernelField, places: Places, reach: float) -> Places:
    tight = pull(field, np.ascontiguousarray(places), WINDOW)
    moved = relax(field, _spaced(tight, SPACING), reach, 12)
    shorter: Places = pull(field, moved, WINDOW)
    # where two pieces in a row are shorter than the window together, making one of them was tried
    if len(shorter) > 2 and np.hypot(*(shorter[2:] - shorter[:-2]).T).max() > WINDOW:
        shorter = pull(field, shorter, 4.0 * WINDOW)
    return shorter


def _spaced(places: Places, apart: float) -> Places:
    """With more places on pieces that are longer than so many cells."""
    out = [places[:1]]
    for begin, end in itertools.pairwise(places):
        steps = max(int(np.ceil(np.hypot(*(end - begin)) / apart)), 1)
        share = np.arange(1, steps + 1)[:, None] / steps
        out.append(begin + share * (end - begin))
        out[-1][-1] = end
    return np.ascontiguousarray(np.concatenate(out))


class Corridor:
    """Places, as fractional (row, col), by (metres along a way, metres to its right)."""

    def __init__(self, way: Places, cells: Cells) -> None:
        self._cells = cells
        self._ends = tuple(way[0].tolist()), tuple(way[-1].tolist())
        at_m = np.column_stack([way[:, 1] * cells.east_m, -way[:, 0] * cells.north_m])
        along_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(at_m, axis=0).T))])
        self.length_m = float(along_m[-1])
        # sideways turns evenly from knot to knot, so that no gap opens outside of a bend
        knots = np.linspace(0.0, self.length_m, max(int(self.length_m / min(cells)), 2) + 1)
        east_m, north_m = (np.interp(knots, along_m, axis) for axis in at_m.T)
        ahead = np.gradient(np.column_stack([east_m, north_m]), axis=0)
        ahead /= np.maximum(np.hypot(*ahead.T), 1e-9)[:, None]
        self._knots = np.column_stack([east_m, north_m, ahead[:, 1], -ahead[:, 0]])
        self._per_m = (len(knots) - 1) / self.length_m
        self._way, self._along_m = way, along_m

    def along_m(self, place: Places) -> float:
        """Metres along the way of one of its own places."""
        return float(self._along_m[int(np.flatnonzero((self._way == place).all(axis=1))[0])])

    def heading_rad(self, along_m: float) -> float:
        """Of the way, clockwise from grid north."""
        _, _, right_e, right_n = self._knot(along_m)
        return math.atan2(-right_n, right_e)

    def _knot(self, along_m: float) -> list[float]:
        at = min(max(along_m * self._per_m, 0.0), len(self._knots) - 1.0)
        n = min(int(at), len(self._knots) - 2)
        share = at - n
        mixed: list[float] = ((1.0 - share) * self._knots[n] + share * self._knots[n + 1]).tolist()
        return mixed

    def place(self, along_m: float, right_m: float) -> tuple[float, float]:
        """Fractional (row, col); the ends are the way's own to the last bit."""
        if right_m == 0.0 and along_m in (0.0, self.length_m):
            return self._ends[0 if along_m == 0.0 else 1]
        east_m, north_m, right_e, right_n = self._knot(along_m)
        return -(north_m + right_m * right_n) / self._cells.north_m, (east_m + right_m * right_e) / self._cells.east_m


@dataclass(frozen=True, eq=False, slots=True)
class CorridorTask:
    """Find a cheaper way near a given one, between each of the places that it has to pass and the next.

    way: (n, 2) fractional posts. fixed: those of its places that stay. half_width_m: of the corridor, which in each
    round is around what the round before found.
    """

    field: KernelField
    way: Places
    fixed: tuple[Places, ...]
    half_width_m: float
    iterations: int
    seed: int
    planner: str = "BITstar"
    rounds: int = 2

    def solve(self, tell: Tell) -> Places | None:
        """Places of the cheapest way that was found; None where none was cheaper. Told as soon as a piece is."""
        first = best = Way(self.way, cost_of(self.field, self.way))
        for number in range(self.rounds):
            # every second round the cuts lie in the middle of the pieces of the round before
            cut = [piece for leg in pieces(best.places, self.fixed) for piece in _cut(leg, PIECE, number % 2 == 1)]
            share = self.iterations / self.rounds / sum(_cells(piece) for piece in cut)
            found: list[Places] = []
            for n, piece in enumerate(cut):
                told = partial(_told_whole, tell, found, cut[n + 1 :])
                found.append(self._of_piece(piece, int(share * _cells(piece)), told))
            places = drop_repeats(np.concatenate(found))
            way = straightened(self.field, Way(places, cost_of(self.field, places)), self.fixed)
            if way.cost < best.cost:
                best = way
                tell(best.places)
        return None if best is first else best.places

    def _of_piece(self, piece: Places, iterations: int, tell: Tell) -> Places:
        """A cheaper way between the ends of a piece, or the piece; each cheaper one is told."""
        corridor = Corridor(piece, self.field.cells)
        bounds = ((0.0, corridor.length_m), (-self.half_width_m, self.half_width_m))
        ends = ((0.0, 0.0), (corridor.length_m, 0.0))
        known = cost_of(self.field, piece)

        def way_of(states: list[State]) -> Way:
            places = drop_repeats(np.array([corridor.place(state[0], state[1]) for state in states]))
            return Way(places, cost_of(self.field, places))

        def better(states: list[State]) -> None:
            way = way_of(states)
            if way.cost < known:
                tell(way.places)

        motions = _InCorridor(self.field, corridor)
        found = solved(box_space(bounds), motions, self.planner, *ends, iterations, better)
        if found is None:
            return piece
        straight = straightened(self.field, way_of(found))
        if not straight.cost < known:
            return piece
        tell(straight.places)
        return straight.places


def _told_whole(tell: Tell, before: list[Places], after: list[Places], piece: Places) -> None:
    """Tell the whole way with one piece of it bettered."""
    tell(drop_repeats(np.concatenate([*before, piece, *after])))


def _cells(places: Places) -> float:
    """How many cells a way crosses."""
    return float(np.hypot(*np.diff(places, axis=0).T).sum())


def _cut(leg: Places, cells: float, halfway: bool) -> list[Places]:
    """A leg in pieces of about so many cells, cut at its own places; the first one half as long, or not."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(leg, axis=0).T))])
    wanted = np.arange(cells * (0.5 if halfway else 1.0), along[-1] - 0.25 * cells, cells)
    at = np.unique(np.concatenate([[0], np.searchsorted(along, wanted), [len(leg) - 1]]))
    return [leg[begin : end + 1] for begin, end in itertools.pairwise(at.tolist())]


@dataclass(frozen=True, eq=False, slots=True)
class _InCorridor:
    field: KernelField
    corridor: Corridor

    def allowed(self, state: State) -> bool:
        row, col = self.corridor.place(state[0], state[1])
        allowed = self.field.allowed
        rows, cols = allowed.shape
        return 0.0 <= row < rows and 0.0 <= col < cols and bool(allowed[int(row), int(col)])

    def cost(self, begin: State, end: State) -> float:
        ends = (*self.corridor.place(begin[0], begin[1]), *self.corridor.place(end[0], end[1]))
        cost = segment_cost(self.field, *ends)[1]
        return float(cost) if math.isfinite(cost) else math.inf
