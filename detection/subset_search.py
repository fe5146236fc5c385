"""Which of an epoch's ranges meet in one point: a bound from candidate points, then every set that could beat it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .kernels import fits, misfits
from .kernels import subsets as kernel

__all__ = ["ConsistentSet", "Ranges", "Rules", "Search", "search"]

Floats = npt.NDArray[np.float64]

# A candidate point of two or three noisy ranges lies further off than a fit of all: so many tolerances are near it.
SLACK = 4.0


class Ranges(NamedTuple):
    """What the kernels take: anchors (n, 3) with zero altitudes in 2D, then (n,) each, metres.

    penalties: −2·log of the odds that a range is occluded rather than clear, before it is measured.
    """

    anchors_m: Floats
    ranges_m: Floats
    sigmas_m: Floats
    tolerances_m: Floats
    penalties: Floats


class Rules(NamedTuple):
    """How a set is tested. flat: 2D. refine: Gauss-Newton after the linear system. studentised: see ``statistics``.

    hint_m: a point on the rover's side of the anchors, NaN along axes where that is not known.
    """

    flat: bool
    refine: bool
    studentised: bool
    least_kept: int
    hint_m: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class ConsistentSet:
    """Ranges that meet: their indices as bits, where, at which squared residuals (sigmas), and the mirrored place.

    nearly_m: a place on the other side of the anchors where they nearly meet; None where there is none.
    """

    kept: int
    place_m: tuple[float, float, float]
    cost: float
    penalty: float
    mirror_m: tuple[float, float, float] | None
    mirror_cost: float
    nearly_m: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class Search:
    """All largest consistent sets, best first; sets tried; whether no set that could matter was left untried."""

    found: tuple[ConsistentSet, ...]
    tried: int
    complete: bool


def search(ranges: Ranges, rules: Rules, limit: int) -> Search:
    """The largest sets that meet, by leaving out none, one, two ... ranges, in at most ``limit`` fits.

    Where all sets are more than that, one found among candidate points bounds how many have to be left out. Where the
    fits run out first, that set is the answer and the search says that it is not complete.
    """
    n = len(ranges.ranges_m)
    table, sets = np.zeros((kernel.MOST, kernel.FOUND)), np.zeros(kernel.MOST, np.int64)
    bound = n - rules.least_kept
    few = sum([math.comb(n, out) for out in range(1, bound + 1)]) <= limit
    count, tried, complete = kernel.largest(ranges, rules, np.arange(n), (0, bound if few else 0), limit, table, sets)
    if count or few:
        # where all ranges are needed, their one set counts as tried though the triangle inequality rules it out
        return Search(_sorted(table, sets, count), tried if bound else 1, complete)
    order = np.arange(n)
    kept, place, cost = kernel.bounded(ranges, rules, SLACK if rules.refine else 1.0)
    if kept:
        bound = n - kernel.bits(kept)
        order = _by_error(ranges, kept, rules.flat, place)
    count, more, complete = kernel.largest(ranges, rules, order, (1, bound), limit - tried, table, sets)
    found = _sorted(table, sets, count)
    if kept and not found:
        # the fits ran out, or the set settles from a candidate point but not from its own linear system
        found = (ConsistentSet(kept, place, cost, 0.0, None, math.inf),)
    return Search(found, tried + more, complete)


def _by_error(ranges: Ranges, kept: int, flat: bool, place: tuple[float, float, float]) -> npt.NDArray[np.int64]:
    excess_m, statistic = np.empty(len(ranges.ranges_m)), np.empty(len(ranges.ranges_m))
    misfits.statistics(ranges, kept, flat, place, False, excess_m, statistic)
    return np.argsort(-statistic)


def _sorted(table: Floats, sets: npt.NDArray[np.int64], count: int) -> tuple[ConsistentSet, ...]:
    found = []
    for row, kept in zip(table[:count].tolist(), sets[:count].tolist(), strict=True):
        cost, *place, other_cost, other_e, other_n, other_u, places, penalty = row
        other = (other_e, other_n, other_u)
        mirror, nearly = (other, None) if places == fits.MIRRORED else (None, other)
        if not math.isfinite(other_cost):
            nearly = None
        found.append(ConsistentSet(kept, (place[0], place[1], place[2]), cost, penalty, mirror, other_cost, nearly))
    return tuple(sorted(found, key=lambda one: one.cost + one.penalty))
