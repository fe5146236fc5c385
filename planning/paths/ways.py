"""Ways over the squares of the field and what is made of them: searched, pulled straight, moved about."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planning.kernels.path_smoothing import pull, relax, way_cost
from planning.kernels.searches import search

from .ends import Ends
from .fields import KernelField

__all__ = ["EIGHT", "SIXTEEN", "Way", "cost_of", "drop_repeats", "grid_way", "pieces", "straightened"]

Places = npt.NDArray[np.float64]

EIGHT = np.array([(0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)], np.int64)
SIXTEEN = np.concatenate(
    [EIGHT, [(a * s, b * t) for a, b in ((1, 2), (2, 1)) for s in (1, -1) for t in (1, -1)]]
).astype(np.int64)
# how long straight pieces are made at once, and how far apart places are put to be moved, in cells
WINDOW = 48.0
SPACING = 6.0


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
    shorter: Places = pull(field, pull(field, moved, WINDOW), 4.0 * WINDOW)
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
