"""Do the ranges of one epoch meet in one point, and which do not (seed 000, "Geometric Occlusion Detection")."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .errors import DetectionInputError
from .verdicts import Classification, SearchReport

__all__ = ["GeometricDetection", "detect_2d", "detect_3d"]

# squared tolerances between two explanations of which the worse cannot be ruled out
AS_LIKELY = 0.7

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class GeometricDetection:
    """What the ranges of one epoch say by themselves; arrays have one entry per range, in the order given.

    occluded: (n,) bool, flagged. excess_m: (n,) range minus distance from the position, NaN without one. statistic:
        (n,) |excess| in tolerances: above 1 = beyond the tolerance. count: ranges that meet at the position.
    position_m, covariance_m2: (d,), (d, d); None where there is none. mirror_m: the other solution, None = only one.
    checked: more ranges than unknowns meet there. candidates: exclusions (indices) that explain the ranges equally
        well, where more than one does. needed: what would settle an undetermined epoch, or "".
    """

    classification: Classification
    occluded: npt.NDArray[np.bool_]
    excess_m: Floats
    statistic: Floats
    count: int
    position_m: Floats | None
    covariance_m2: Floats | None
    mirror_m: Floats | None
    checked: bool
    candidates: tuple[tuple[int, ...], ...]
    search: SearchReport
    needed: str


def detect_2d(
    anchor_positions_m: npt.ArrayLike,
    ranges_m: npt.ArrayLike,
    tolerance_m: npt.ArrayLike = 0.1,
    *,
    studentised: bool = False,
    side_hint_m: tuple[float, float] | None = None,
    search_limit: int = 2000,
) -> GeometricDetection:
    """Geometric detection in the plane (seed 000, 2D steps 1-7): (n, 2) anchors east, north, (n,) ranges, metres.

    tolerance_m: one for all or (n,), the error up to which a range meets a point. studentised: hold each error against
        what the fit left of it, so that a tolerance of k sigma flags a clear range as often as k says.
    side_hint_m: a point on the rover's side of anchors that stand on one line.
    search_limit: subsets tried before the search is cut short. Raises DetectionInputError.
    """
    return _detect(anchor_positions_m, ranges_m, tolerance_m, 2, studentised, side_hint_m, search_limit)


def detect_3d(
    anchor_positions_m: npt.ArrayLike,
    ranges_m: npt.ArrayLike,
    tolerance_m: npt.ArrayLike = 0.1,
    *,
    studentised: bool = False,
    hint_m: tuple[float, float, float] | None = None,
    search_limit: int = 2000,
) -> GeometricDetection:
    """Geometric detection in space (seed 000, 3D steps 1-8): (n, 3) anchors east, north, altitude; the rest as in 2D.

    hint_m: a point on the rover's side of anchors that stand in one plane. Raises DetectionInputError.
    """
    return _detect(anchor_positions_m, ranges_m, tolerance_m, 3, studentised, hint_m, search_limit)


def _detect(
    anchor_positions_m: npt.ArrayLike,
    ranges_m: npt.ArrayLike,
    tolerance_m: npt.ArrayLike,
    dimension: int,
    studentised: bool,
    hint_m: tuple[float, ...] | None,
    search_limit: int,
) -> GeometricDetection:
    anchors_m, ranges_m, tolerances_m = checked_ranges(anchor_positions_m, ranges_m, tolerance_m, dimension)
    n = len(ranges_m)
    none = np.zeros(n, np.bool_)
    unknown = np.full(n, np.nan)
    if n < dimension:
        needed = f"{dimension + 1 - n} more ranges: {n} allow no position."
        return GeometricDetection(
            Classification.UNDETERMINED,
            none,
            unknown,
            unknown,
            0,
            None,
            None,
            None,
            False,
            (),
            SearchReport(0, True),
            needed,
        )
    tried = 0
    found: list[tuple[float, tuple[int, ...], Floats, Floats, Floats, Floats]] = []
    for out in range(max(n - dimension, 1)):
        for excluded in itertools.combinations(range(n), out):
            if tried >= search_limit:
                break
            tried += 1
            kept = np.array([i not in excluded for i in range(n)])
            for start in starts(anchors_m, ranges_m, kept):
                position, covariance, excess, leverage = fit(anchors_m, ranges_m, tolerances_m, kept, start)
                scale = np.sqrt(np.maximum(1.0 - leverage, 1e-9)) if studentised else 1.0
                statistic = np.abs(excess) / tolerances_m / scale
                if np.all(statistic[kept] <= 1.0):
                    cost = float(np.sum((excess[kept] / tolerances_m[kept]) ** 2))
                    found.append((cost, excluded, position, covariance, excess, statistic))
        if found:
            break
    search = SearchReport(tried, tried < search_limit)
    if not found:
        return GeometricDetection(
            Classification.UNDETERMINED, none, unknown, unknown, 0, None, None, None, False, (), search,
            f"More ranges, or a prediction of who is in sight: no {dimension + 1} of the {n} ranges meet in one point."
            if n > dimension else "Ranges that meet.",
        )  # fmt: skip
    found.sort(key=lambda entry: entry[0])
    _, excluded, position, covariance, excess, statistic = found[0]
    occluded = np.isin(np.arange(n), excluded)
    candidates = tuple(dict.fromkeys(entry[1] for entry in found if entry[0] - found[0][0] < AS_LIKELY))
    classification = (Classification.NONE, Classification.SINGLE, Classification.MULTIPLE)[min(len(excluded), 2)]
    if len(candidates) > 1 or n == dimension:
        classification = Classification.UNDETERMINED
        occluded = none
    return GeometricDetection(
        classification, occluded, excess, statistic, n - len(excluded), position, covariance, None,
        n - len(excluded) > dimension, candidates, search, "",
    )  # fmt: skip


def checked_ranges(
    anchor_positions_m: npt.ArrayLike, ranges_m: npt.ArrayLike, tolerance_m: npt.ArrayLike, dimension: int
) -> tuple[Floats, Floats, Floats]:
    """Anchors (n, d), ranges (n,) and tolerances (n,) as arrays; raises DetectionInputError."""
    ranges = np.array(ranges_m, np.float64)
    anchors = np.array(anchor_positions_m, np.float64)
    if ranges.ndim != 1 or (len(ranges) and anchors.shape != (len(ranges), dimension)):
        raise DetectionInputError(
            f"Of {dimension}D anchors (n, {dimension}) and ranges (n,), shapes {anchors.shape} and {ranges.shape} came."
        )
    if not (np.isfinite(anchors).all() and np.isfinite(ranges).all() and (ranges > 0.0).all()):
        raise DetectionInputError("Anchor positions must be finite, and ranges finite and > 0 m.")
    tolerances = np.empty(len(ranges))
    if np.shape(tolerance_m) not in ((), ranges.shape):
        raise DetectionInputError(f"tolerance_m must be one number or ({len(ranges)},), not {np.shape(tolerance_m)}.")
    tolerances[:] = tolerance_m
    if not (np.isfinite(tolerances).all() and (tolerances > 0.0).all()):
        raise DetectionInputError(f"tolerance_m must be > 0 m, not {tolerance_m!r}.")
    return anchors.reshape(len(ranges), dimension), ranges, tolerances


def starts(anchors_m: Floats, ranges_m: Floats, kept: npt.NDArray[np.bool_]) -> Iterator[Floats]:
    """Points to begin a fit from: of the differences of squared ranges, and its mirror images out of their plane."""
    anchors, ranges = anchors_m[kept], ranges_m[kept]
    middle = anchors.mean(axis=0)
    centred = anchors - middle
    squares = (centred**2).sum(axis=1) - ranges**2
    _, spread, axes = np.linalg.svd(2.0 * centred)
    flat = np.linalg.lstsq(2.0 * centred, squares - squares.mean(), rcond=0.05)[0]
    yield middle + flat
    if len(spread) == anchors.shape[1] and spread[-1] > 0.05 * spread[0]:
        return
    normal = axes[-1]
    height2 = float(np.mean(ranges**2 - ((flat - centred) ** 2).sum(axis=1)))
    if height2 > 0.0:
        yield middle + flat + normal * math.sqrt(height2)
        yield middle + flat - normal * math.sqrt(height2)


def fit(
    anchors_m: Floats, ranges_m: Floats, tolerances_m: Floats, kept: npt.NDArray[np.bool_], start_m: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """(position, covariance in squared tolerances, excess of all, leverage of all) by Gauss-Newton."""
    position = start_m.copy()
    weights = np.where(kept, tolerances_m**-2.0, 0.0)
    for _ in range(10):
        offset = position - anchors_m
        distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-9)
        direction = offset / distance[:, None]
        covariance = np.linalg.pinv((direction * weights[:, None]).T @ direction)
        step = covariance @ (direction * weights[:, None]).T @ (ranges_m - distance)
        position += step
        if np.linalg.norm(step) < 1e-6:
            break
    leverage = np.einsum("ni,ij,nj->n", direction, covariance, direction) * weights
    return position, covariance, ranges_m - np.linalg.norm(position - anchors_m, axis=1), leverage
