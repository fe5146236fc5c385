"""Do the ranges of one epoch meet in one point, and which do not (seed 000, "Geometric Occlusion Detection")."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from .errors import DetectionInputError
from .kernels import misfits
from .subset_search import ConsistentSet, Ranges, Rules, Search, covariance_of, search, settled_side
from .verdicts import Classification, SearchReport

__all__ = ["MOST_RANGES", "GeometricDetection", "detect_2d", "detect_3d", "detect_ranges"]

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

MOST_RANGES = 62  # a set is the bits of one signed integer
# An explanation has to be so probable among those that leave out as many ranges before it is believed.
BELIEVED = 0.95
UNSEARCHED = SearchReport(0, True, 0)
DEFAULT_K = 3.0  # sigmas in a tolerance where no sigma is given


@dataclass(frozen=True, slots=True, eq=False)
class GeometricDetection:
    """What the ranges of one epoch say by themselves; arrays have one entry per range, in the order given.

    off, unknown: (n,) bool, surely not one of those that meet; not to be told. p_occluded: (n,) share of the
        explanations that leave it out.
    excess_m: (n,) range minus distance from the position, NaN without one. statistic: (n,) |excess| in tolerances:
        above 1 = beyond the tolerance. count: ranges that meet at the position. least_occluded: so many at least.
    position_m, covariance_m2: (d,), (d, d); None where there is none. mirror_m: the other solution, None = only one;
        of two places position_m is the lower. nearly_m: a place on the other side where they nearly meet, or None.
    checked: more ranges than unknowns meet there. candidates: exclusions (indices) that explain the ranges about
        equally well, where more than one does. needed: what would settle an undetermined epoch, or "".
    """

    classification: Classification
    off: Bools
    unknown: Bools
    p_occluded: Floats
    excess_m: Floats
    statistic: Floats
    count: int
    least_occluded: int
    position_m: Floats | None
    covariance_m2: Floats | None
    mirror_m: Floats | None
    nearly_m: Floats | None
    checked: bool
    candidates: tuple[tuple[int, ...], ...]
    search: SearchReport
    needed: str

    @property
    def occluded(self) -> Bools:
        """(n,) bool: off, and too long."""
        return self.off & ~(self.excess_m < 0.0)

    @property
    def too_short(self) -> Bools:
        """(n,) bool: off, and too short, which no occlusion explains."""
        return self.off & (self.excess_m < 0.0)


def detect_2d(
    anchor_positions_m: npt.ArrayLike,
    ranges_m: npt.ArrayLike,
    tolerance_m: npt.ArrayLike = 0.1,
    *,
    sigma_m: npt.ArrayLike | None = None,
    studentised: bool = False,
    method: Literal["refined", "seed"] = "refined",
    hint_m: npt.ArrayLike | None = None,
    search_limit: int = 1500,
) -> GeometricDetection:
    """Geometric detection in the plane (seed 000, 2D steps 1-7): (n, 2) anchors east, north, (n,) ranges, metres.

    tolerance_m: one for all or (n,), the error up to which a range meets a point. sigma_m: of the ranges, for weights
        and covariance; None = a third of the tolerance. studentised: hold each error against what the fit left of it,
        so that a tolerance of k sigma is exceeded by clear ranges as often as k says.
    method: "seed" follows the specification to the letter (intersection points, no refinement); "refined" fits the
        ranges that meet by Gauss-Newton.
    hint_m: a point on the rover's side of anchors that stand on one line; NaN = not known along that axis.
    search_limit: fits tried before the search is cut short. Raises DetectionInputError.
    """
    return _detect(anchor_positions_m, ranges_m, tolerance_m, 2, sigma_m, studentised, method, hint_m, search_limit)


def detect_3d(
    anchor_positions_m: npt.ArrayLike,
    ranges_m: npt.ArrayLike,
    tolerance_m: npt.ArrayLike = 0.1,
    *,
    sigma_m: npt.ArrayLike | None = None,
    studentised: bool = False,
    method: Literal["refined", "seed"] = "refined",
    hint_m: npt.ArrayLike | None = None,
    search_limit: int = 1500,
) -> GeometricDetection:
    """Geometric detection in space (seed 000, 3D steps 1-8): (n, 3) anchors east, north, altitude; the rest as in 2D.

    hint_m: a point on the rover's side of anchors that lie in one plane, often only its altitude: (NaN, NaN, 0).
    Raises DetectionInputError.
    """
    return _detect(anchor_positions_m, ranges_m, tolerance_m, 3, sigma_m, studentised, method, hint_m, search_limit)


def _detect(
    anchor_positions_m: npt.ArrayLike,
    ranges_m: npt.ArrayLike,
    tolerance_m: npt.ArrayLike,
    dimension: Literal[2, 3],
    sigma_m: npt.ArrayLike | None,
    studentised: bool,
    method: str,
    hint_m: npt.ArrayLike | None,
    search_limit: int,
) -> GeometricDetection:
    if method not in ("refined", "seed"):
        raise DetectionInputError(f"method must be refined or seed, not {method!r}.")
    if search_limit < 1:
        raise DetectionInputError(f"search_limit must be at least 1, not {search_limit}.")
    measured = _per_range("ranges_m", ranges_m, np.shape(ranges_m))
    if measured.ndim != 1 or len(measured) > MOST_RANGES:
        raise DetectionInputError(f"ranges_m must be (n,) with n at most {MOST_RANGES}, not {measured.shape}.")
    places = np.zeros((len(measured), 3))
    if len(measured):
        given = np.array(anchor_positions_m, np.float64)
        if given.shape != (len(measured), dimension) or not np.isfinite(given).all():
            raise DetectionInputError(
                f"anchor_positions_m must be ({len(measured)}, {dimension}) finite metres, not {given.shape}."
            )
        places[:, :dimension] = given
    tolerances = _per_range("tolerance_m", tolerance_m, measured.shape)
    sigmas = tolerances / DEFAULT_K if sigma_m is None else _per_range("sigma_m", sigma_m, measured.shape)
    hint = np.full(dimension, np.nan) if hint_m is None else np.array(hint_m, np.float64)
    if hint.shape != (dimension,):
        raise DetectionInputError(f"hint_m must be ({dimension},), not {hint.shape}.")
    ranges = Ranges(places, measured, sigmas, tolerances, np.zeros(len(measured)))
    refine = method == "refined"
    return detect_ranges(ranges, dimension, hint, refine=refine, studentised=studentised and refine, limit=search_limit)


def _per_range(name: str, values: npt.ArrayLike, shape: tuple[int, ...]) -> Floats:
    if np.shape(values) not in ((), shape):
        raise DetectionInputError(f"{name} must be one number or {shape}, not {np.shape(values)}.")
    filled = np.empty(shape)
    filled[...] = values
    if not (np.isfinite(filled).all() and (filled > 0.0).all()):
        raise DetectionInputError(f"{name} must be finite and > 0 m.")
    return filled


def detect_ranges(
    ranges: Ranges, dimension: Literal[2, 3], hint_m: Floats, *, refine: bool, studentised: bool, limit: int
) -> GeometricDetection:
    """The same for ranges already checked, with the prior odds they carry."""
    n = len(ranges.ranges_m)
    if n < dimension:
        return _without_position(n, f"{_more(dimension + 1 - n)}: {n} allow no position.")
    east_m, north_m, up_m = (*hint_m.tolist(), math.nan)[:3]
    rules = Rules(dimension == 2, refine, studentised, min(dimension + 1, n), (east_m, north_m, up_m))
    searched = search(ranges, rules, limit)
    report = SearchReport(searched.tried, searched.complete, searched.sets)
    if not searched.found:
        return _without_position(n, _why_nothing_meets(n, dimension, searched), report, searched.least_out)
    best = searched.found[0]
    odds = [math.exp(0.5 * (_merit(best) - _merit(one))) for one in searched.found]
    weights = [one / sum(odds) for one in odds]
    left_out = np.array([[not one.kept >> i & 1 for i in range(n)] for one in searched.found])
    p_occluded = np.array(weights) @ left_out
    unknown = (p_occluded > 1.0 - BELIEVED) & (p_occluded < BELIEVED)
    best, mirror_m = settled_side(best, dimension)
    kept = best.kept.bit_count()
    excess_m, statistic = np.empty(n), np.empty(n)
    misfits.statistics(ranges, best.kept, rules.flat, best.place_m, studentised, excess_m, statistic)
    if not searched.trusted or n == dimension or _by_chance(kept, statistic[left_out[0]], dimension) > 1.0 - BELIEVED:
        unknown[:] = True
    blind = np.zeros(n, np.bool_)
    if kept > dimension:
        bits = misfits.unwatched(ranges, best.kept, rules.flat, best.place_m)
        blind = np.array([bool(bits >> i & 1) for i in range(n)])
        unknown |= blind
    undetermined = bool(unknown.any())
    likely = [number for number, weight in enumerate(weights) if weight > 1.0 - BELIEVED]
    position_m = np.array(best.place_m[:dimension])
    too_long = int((left_out[0] & (excess_m > 0.0)).sum())
    classification = (Classification.NONE, Classification.SINGLE, Classification.MULTIPLE)[min(too_long, 2)]
    needed = ""
    if undetermined:
        classification = Classification.UNDETERMINED
        needed = f"{_more(1)}, a prediction of who is in sight, or odometry" + (
            f": {n} ranges cannot check one another."
            if n == dimension
            else f"; or a larger search_limit: {_not_all(searched)}."
            if not searched.trusted
            else f": nothing checks {blind.sum()} of {n} ranges."
            if blind.any()
            else f": so few of {n} ranges may meet by chance."
            if len(likely) == 1
            else f": {len(likely)} explanations fit."
        )
    elif mirror_m is not None:
        needed = "An altitude or a side: anchors in one plane leave two places." if dimension == 3 else (
            "A side: anchors on one line leave two places."
        )  # fmt: skip
    return GeometricDetection(
        classification,
        left_out[0] & ~unknown,
        unknown,
        p_occluded,
        excess_m,
        statistic,
        kept,
        n - kept if searched.trusted else searched.least_out,
        position_m,
        covariance_of(ranges, ~left_out[0], position_m),
        mirror_m,
        None if best.nearly_m is None else np.array(best.nearly_m[:dimension]),
        kept > dimension and not undetermined,
        tuple(tuple(np.flatnonzero(left_out[number]).tolist()) for number in likely) if len(likely) > 1 else (),
        report,
        needed,
    )


def _by_chance(kept: int, statistic_left_out: Floats, dimension: int) -> float:
    """How many sets as large would meet by chance, where most ranges are left out; 0 where most are kept.

    A range that is off by some tens of tolerances lands within one of a given point in one of as many cases.
    """
    n = kept + len(statistic_left_out)
    if 2 * kept > n:
        return 0.0
    share = min(1.0, 1.0 / float(np.median(statistic_left_out)))
    return math.comb(n, kept) * share ** (kept - dimension)


def _merit(one: ConsistentSet) -> float:
    return one.cost + one.penalty


def _more(count: int) -> str:
    return "One more range" if count == 1 else f"{count} more ranges"


def _why_nothing_meets(n: int, dimension: int, searched: Search) -> str:
    if n == dimension:
        return f"One more range: the {n} there are do not meet in a point."
    if not searched.complete:
        return f"A larger search_limit, more ranges, or a prediction of who is in sight: {_not_all(searched)}."
    return f"More ranges or a prediction of who is in sight: no {dimension + 1} of the {n} ranges meet in one point."


def _not_all(searched: Search) -> str:
    return f"only {searched.tried:,} of {searched.sets:,} sets of ranges were searched"


def _without_position(n: int, needed: str, report: SearchReport = UNSEARCHED, least: int = 0) -> GeometricDetection:
    nothing, all_unknown = np.full(n, np.nan), np.ones(n, np.bool_)
    return GeometricDetection(
        Classification.UNDETERMINED, ~all_unknown, all_unknown, np.full(n, 0.5), nothing, nothing.copy(),
        0, least, None, None, None, None, False, (), report, needed,
    )  # fmt: skip
