"""Placement by brute force: every set of anchors, every target, one line of plain Python each."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

Sight = Sequence[Sequence[bool]]  # of each candidate: which targets it sees


def share_covered(sight: Sight, chosen: Sequence[int], needed: int, weight: Sequence[float] | None = None) -> float:
    """Share of the targets that see at least so many of the chosen."""
    targets = range(len(sight[0]))
    worth = [1.0] * len(sight[0]) if weight is None else weight
    good = sum(worth[i] for i in targets if sum(sight[c][i] for c in chosen) >= needed)
    return good / sum(worth)


def dilution(anchors_m: Sequence[Sequence[float]], point_m: Sequence[float], clock: bool = False) -> float:
    """PDOP of ranges by numpy's pseudo-inverse-free way: inf where the geometry matrix has no full rank."""
    rows = []
    for anchor_m in anchors_m:
        line = np.subtract(anchor_m, point_m)
        rows.append([*(line / np.linalg.norm(line)), *([1.0] if clock else [])])
    unknowns = 4 if clock else 3
    if len(rows) < unknowns or np.linalg.matrix_rank(np.array(rows), tol=1e-6) < unknowns:
        return math.inf
    matrix = np.array(rows)
    return math.sqrt(np.trace(np.linalg.inv(matrix.T @ matrix)[:3, :3]))


def share_with_dilution(
    sight: Sight, anchors_m: np.ndarray, points_m: np.ndarray, chosen: Sequence[int], needed: int, limit: float
) -> float:
    """Share of the targets with enough of the chosen in sight and a PDOP below the limit."""
    good = 0
    for i, point_m in enumerate(points_m):
        seen = [anchors_m[c] for c in chosen if sight[c][i]]
        good += len(seen) >= needed and dilution(seen, point_m) < limit
    return good / len(points_m)


def mean_error(
    sight: Sight, anchors_m: np.ndarray, points_m: np.ndarray, chosen: Sequence[int], sigma_m: float, most_m: float
) -> float:
    """Mean of sigma times PDOP over the targets, each at most so much."""
    errors = []
    for i, point_m in enumerate(points_m):
        seen = [anchors_m[c] for c in chosen if sight[c][i]]
        errors.append(min(sigma_m * dilution(seen, point_m), most_m))
    return float(np.mean(errors))


def best_set(value: Callable[[Sequence[int]], float], candidates: int, count: int) -> tuple[float, tuple[int, ...]]:
    """(largest value, a set that has it) of all sets of so many candidates."""
    return max(
        ((value(chosen), chosen) for chosen in combinations(range(candidates), count)), key=lambda found: found[0]
    )
