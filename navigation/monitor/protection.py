"""Protection levels from predicted geometry: what a monitor may miss, at points or along a route."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError
from ..inputs import positions, table
from .kernels.protection import protection_levels as fill_levels

__all__ = ["ProtectionLevels", "ProtectionRisk", "predict_protection", "protection_levels"]

Array = npt.NDArray[np.float64]
MOST_HYPOTHESES = 20_000


@dataclass(frozen=True)
class ProtectionRisk:
    """What is allowed.

    missed: probability that a position is off by more than a level and no alarm says so, half of it for the height.
    false_alarm: rate at which right measurements alarm. unwatched: sets of faults that together are less likely than
    this get no hypothesis; it is taken off ``missed``. most_faults: the largest set of faults at once.
    Raises MeasurementError.
    """

    missed: float = 1e-4
    false_alarm: float = 1e-3
    unwatched: float = 1e-6
    most_faults: int = 3

    def __post_init__(self) -> None:
        if not (0.0 < self.missed < 1.0 and 0.0 < self.false_alarm < 1.0):
            raise MeasurementError("missed and false_alarm must lie between 0 and 1.")
        if not 0.0 <= self.unwatched < self.missed:
            raise MeasurementError("unwatched must be zero or more and below missed.")
        if not 0 <= self.most_faults <= 6:
            raise MeasurementError(f"most_faults must be 0 to 6, not {self.most_faults}.")


@dataclass(frozen=True, eq=False)
class ProtectionLevels:
    """Levels of p points, metres; inf where nothing can be promised.

    axes_m: (p, 3) east, north, up. unwatched: (p,) probability of what no hypothesis covers.
    """

    axes_m: Array
    unwatched: Array

    @property
    def horizontal_m(self) -> Array:
        """(p,) of both horizontal axes together."""
        level: Array = np.hypot(self.axes_m[:, 0], self.axes_m[:, 1])
        return level

    @property
    def vertical_m(self) -> Array:
        """(p,) of the height."""
        return self.axes_m[:, 2]


def protection_levels(
    rows: npt.ArrayLike, sigmas: npt.ArrayLike, faults: npt.ArrayLike, risk: ProtectionRisk | None = None
) -> ProtectionLevels:
    """How far off positions from these measurements may be though the separation of solutions says nothing.

    rows: (p, m, n), the position's three numbers first. sigmas: (p, m), inf = not in sight. faults: (p, m) probability
    that each measurement is wrong, by any amount. Multiple hypotheses, as Blanch et al., Baseline ARAIM (2015), with
    sets of any size up to most_faults; what they leave is ``unwatched``, and a point where that exceeds ``missed`` is
    promised nothing. Raises MeasurementError.
    """
    asked = ProtectionRisk() if risk is None else risk
    a = np.array(rows, np.float64, order="C")
    if a.ndim != 3 or a.shape[2] < 3:
        raise MeasurementError(f"rows must be (points, measurements, unknowns) of 3 unknowns or more, not {a.shape}.")
    points, count, _ = a.shape
    s = table("sigmas", sigmas, points, count, MeasurementError)
    p = table("faults", faults, points, count, MeasurementError)
    if not (s > 0.0).all():
        raise MeasurementError("sigmas must be above zero, inf for what is not in sight.")
    seen = np.isfinite(s)
    if not ((p >= 0.0) & (p < 1.0))[seen].all() or not np.isfinite(a[seen]).all():
        raise MeasurementError("faults must be probabilities below 1, and the rows of what is in sight finite.")
    hypotheses = sum(math.comb(count, f) for f in range(min(asked.most_faults, count) + 1))
    if hypotheses > MOST_HYPOTHESES:
        raise MeasurementError(
            f"{count} measurements with up to {asked.most_faults} faults make {hypotheses:,} hypotheses; "
            f"{MOST_HYPOTHESES:,} are the most."
        )
    levels, missed = np.full((points, 3), math.inf), np.ones(points)
    told = np.array([asked.missed, asked.false_alarm, asked.unwatched, asked.most_faults], np.float64)
    fill_levels(a, s, np.where(seen, p, 0.0), told, hypotheses + 1, levels, missed)
    return ProtectionLevels(levels, missed)


def predict_protection(
    points_m: npt.ArrayLike,
    anchors_m: npt.ArrayLike,
    sight: npt.ArrayLike,
    range_sigma_m: npt.ArrayLike,
    *,
    least_sight: float = 0.5,
    fault: float = 1e-3,
    height_sigma_m: float = math.inf,
    clock: bool = False,
    risk: ProtectionRisk | None = None,
) -> ProtectionLevels:
    """Levels at points, or along a route before it is driven, of ranges to anchors and the map's foresight.

    points_m: (p, 3), anchors_m: (k, 3) east, north, up. sight: (p, k), or bool: probability that each anchor is in
    sight. Below least_sight a range is left out before any test; a hidden one that comes all the same comes over a
    detour, so that its probability of being wrong is 1 - sight, and ``fault`` besides. range_sigma_m: for each, or one
    for all. height_sigma_m: of the ground's height, which is never wrong by more; inf = the map's height is not used.
    clock: the ranges share a receiver's clock. Raises MeasurementError.
    """
    points, anchors = positions("points_m", points_m), positions("anchors_m", anchors_m)
    shape = len(points), len(anchors)
    seen = table("sight", np.asarray(sight, np.float64), *shape, MeasurementError)
    sigmas = table("range_sigma_m", range_sigma_m, *shape, MeasurementError)
    if not ((seen >= 0.0) & (seen <= 1.0)).all():
        raise MeasurementError("sight must be probabilities from 0 to 1.")
    if not 0.0 <= fault < 1.0 or not 0.0 < least_sight <= 1.0 or not height_sigma_m > 0.0:
        raise MeasurementError("fault must be a probability below 1, least_sight and height_sigma_m above 0.")
    away = points[:, None] - anchors[None]
    length = np.linalg.norm(away, axis=2, keepdims=True)
    units = np.divide(away, length, out=np.zeros_like(away), where=length > 0.0)
    rows = np.zeros((shape[0], shape[1] + 1, 4 if clock else 3))
    rows[:, :-1, :3] = units
    rows[:, -1, 2] = 1.0
    if clock:
        rows[:, :-1, 3] = 1.0
    used = np.where(seen >= least_sight, sigmas, math.inf)
    sigmas = np.column_stack([used, np.full(shape[0], height_sigma_m)])
    faults = np.column_stack([1.0 - seen * (1.0 - fault), np.zeros(shape[0])])
    return protection_levels(rows, sigmas, np.minimum(faults, 1.0 - 1e-12), risk)
