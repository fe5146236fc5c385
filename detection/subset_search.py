"""Which of an epoch's ranges meet in one point, and where: by candidate points, then by all sets that may beat them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .kernels import candidates as near
from .kernels import fits, misfits, triples
from .kernels import subsets as kernel
from .kernels.linear_systems import Ranges
from .kernels.subsets import Limits, Rules

__all__ = [
    "ConsistentSet",
    "Ranges",
    "Rules",
    "Search",
    "covariance_of",
    "most_steps",
    "search",
    "settled_side",
    "squared_sigmas",
]

Floats = npt.NDArray[np.float64]

# A candidate point of two or three noisy ranges lies further off than a fit of all: so many tolerances are near it.
SLACK = 4.0
# A fit looks at every pair of ranges once, and at all ranges in so many rounds of its descents and tests.
USUAL_ROUNDS = 20
ENDLESS = 2**62
FOR_TRIPLES = 4  # of the work that is left, what three ranges rule out may take this part
UNKNOWN = np.zeros((0, 0, 0), np.int64)  # what three ranges rule out


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
    """All largest consistent sets, best first, and how surely they are all.

    tried: sets fitted, of ``sets`` that are as large or larger; those that two or three of their ranges rule out
        need no fit. complete: no set that could matter was left untried. least_out: no set that leaves out fewer meets.
    trusted: where not complete, whether every candidate point was looked at, and nothing larger was found elsewhere.
    steps: the work, in ranges looked at.
    """

    found: tuple[ConsistentSet, ...]
    tried: int
    complete: bool
    sets: int
    least_out: int
    trusted: bool
    steps: int


def most_steps(count: int, limit: int) -> int:
    """The work that a search among so many ranges may take: ``limit`` fits of all of them, as they usually are."""
    return limit * count * (count // 2 + USUAL_ROUNDS)


def search(ranges: Ranges, rules: Rules, limit: int) -> Search:
    """The largest sets that meet, by leaving out none, one, two ... ranges, in at most ``limit`` fits.

    Where all sets are more than that, those found among candidate points bound how many have to be left out. Where the
    fits or ``most_steps`` run out first, they are the answer and the search says that it is not complete.
    """
    n = len(ranges.ranges_m)
    table, sets = np.zeros((kernel.MOST, kernel.FOUND)), np.zeros(kernel.MOST, np.int64)
    bound = n - rules.least_kept
    few = _sets(n, bound) - 1 <= limit  # then the number of fits bounds the work
    most = ENDLESS if few else most_steps(n, limit)
    limits, levels = Limits(limit, most), (0, bound if few else 0)
    count, tried, steps, complete, out = kernel.largest(
        ranges, rules, np.arange(n), levels, limits, table, sets, UNKNOWN
    )
    if count or few:
        # where all ranges are needed, their one set counts as tried though the triangle inequality rules it out
        found = _sorted(table, sets, count)
        return Search(found, tried if bound else 1, complete, _sets(n, min(out, bound)), out, True, steps)
    notes = near.Notes(np.zeros_like(table), np.zeros_like(sets), np.zeros_like(sets), np.zeros(4, np.int64))
    seen_all = near.candidates(ranges, rules, SLACK if rules.refine else 1.0, most - steps, notes)
    by_points = _sorted(notes.table, notes.sets, int(notes.tally[near.COUNT]))
    steps += int(notes.tally[near.STEPS])
    order = np.arange(n)
    if by_points:
        bound = n - by_points[0].kept.bit_count()
        order = _by_error(ranges, int(notes.sets[0]), rules.flat, _place(notes.table[0]))
    ruled_out, looks = UNKNOWN, 2 * n * math.comb(n, 3)
    if not rules.flat and looks <= (most - steps) // FOR_TRIPLES:
        ruled_out = triples.ruled_out(triples.in_order(ranges, order))
        steps += looks
    levels, limits = (1, bound), Limits(limit - tried, most - steps)
    count, more, more_steps, complete, out = kernel.largest(
        ranges, rules, order, levels, limits, table, sets, ruled_out
    )
    found, tried, steps = _sorted(table, sets, count), tried + more, steps + more_steps
    trusted = complete or (seen_all and (not found or out == bound))
    if not complete and by_points and (not found or out == bound):
        met = {one.kept for one in found}
        found = _best_first([*found, *(one for one in by_points if one.kept not in met)])
    elif not found:
        # the sets settle from a candidate point but not from their own linear system
        found = by_points
    left_out = n - found[0].kept.bit_count() if found else bound
    least_out = left_out if complete else min(out, left_out)
    return Search(found, tried, complete, _sets(n, left_out), least_out, trusted, steps)


def _sets(count: int, most_out: int) -> int:
    """How many sets leave out at most so many."""
    return sum(math.comb(count, out) for out in range(most_out + 1))


def _by_error(ranges: Ranges, kept: int, flat: bool, place: tuple[float, float, float]) -> npt.NDArray[np.int64]:
    excess_m, statistic = np.empty(len(ranges.ranges_m)), np.empty(len(ranges.ranges_m))
    misfits.statistics(ranges, kept, flat, place, False, excess_m, statistic)
    return np.argsort(-statistic)


def _sorted(table: Floats, sets: npt.NDArray[np.int64], count: int) -> tuple[ConsistentSet, ...]:
    found = []
    for row, kept in zip(table[:count].tolist(), sets[:count].tolist(), strict=True):
        cost, east_m, north_m, up_m, other_cost, other_e, other_n, other_u, places, penalty = row
        other = (other_e, other_n, other_u)
        mirror, nearly = (other, None) if places == fits.MIRRORED else (None, other)
        if not math.isfinite(other_cost):
            nearly = None
        found.append(ConsistentSet(kept, (east_m, north_m, up_m), cost, penalty, mirror, other_cost, nearly))
    return _best_first(found)


def _best_first(found: list[ConsistentSet]) -> tuple[ConsistentSet, ...]:
    return tuple(sorted(found, key=lambda one: one.cost + one.penalty))


def _place(row: Floats) -> tuple[float, float, float]:
    _, east_m, north_m, up_m, *_ = row.tolist()
    return east_m, north_m, up_m


# Where ranges say nothing along an axis the covariance is this much larger than along the best known one.
UNKNOWN_ALONG = 1e-12
# Variances further apart than this are nothing but a filter's rounding.
LEAST_SHARE = 1e-12


def settled_side(one: ConsistentSet, dimension: int) -> tuple[ConsistentSet, Floats | None]:
    """The set at its place, and the mirrored place where both are left; in 3D the lower comes first: drones fly."""
    place_m, mirror_m = one.place_m, one.mirror_m
    if mirror_m is None:
        return one, None
    if dimension == 3 and mirror_m[2] < place_m[2]:
        place_m, mirror_m = mirror_m, place_m
        one = replace(one, place_m=place_m, mirror_m=mirror_m, cost=one.mirror_cost, mirror_cost=one.cost)
    return one, np.array(mirror_m[:dimension])


def covariance_of(ranges: Ranges, kept: npt.NDArray[np.bool_], place_m: Floats) -> Floats:
    """(d, d) covariance of the least squares at a place (d,), m²; huge along an axis that the ranges say nothing of."""
    offset = place_m - ranges.anchors_m[kept, : len(place_m)]
    distance = np.maximum(np.sqrt((offset * offset).sum(axis=1)), 1e-9)
    rows = offset / (distance * ranges.sigmas_m[kept])[:, None]
    normal = rows.T @ rows
    if not math.isfinite(normal.trace()):
        return np.full_like(normal, np.nan)
    # by axes, so that no rounding makes a variance negative
    weights, axes = np.linalg.eigh(normal)
    covariance: Floats = axes / np.maximum(weights, UNKNOWN_ALONG * weights.sum()) @ axes.T
    return covariance


def squared_sigmas(off_m: Floats, covariance_m2: Floats) -> float:
    """How far off in squared sigmas; 0 where the covariance is none, so that nothing can be said to be far."""
    if not (math.isfinite(covariance_m2.sum()) and covariance_m2.trace() > 0.0):
        return 0.0
    variances_m2, axes = np.linalg.eigh(0.5 * (covariance_m2 + covariance_m2.T))
    along_m = off_m @ axes
    return float((along_m * along_m / np.maximum(variances_m2, LEAST_SHARE * variances_m2[-1])).sum())
