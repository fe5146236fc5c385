"""Positioning limits along a path by exact sight lines: which squares the field took for better than they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from visibility import MinimumVisibleAltitude

from .describing import Sightings, sampled, sightings
from .fields import CostField, bit_of
from .outcomes import Reason
from .problems import PathProblem

__all__ = ["without_hidden_squares"]

# how closely sight lines are asked along a path, in cells: everywhere, and where a line that counts is near the ground
COARSE, FINE = 0.5, 0.0625
NEAR_M_PER_CELL = 0.25


def without_hidden_squares(
    problem: PathProblem, field: CostField, minimum: MinimumVisibleAltitude | None, places: npt.NDArray[np.float64]
) -> CostField | None:
    """The field without the squares in which a path breaks a limit on positioning; None where it breaks none."""
    if minimum is None or not problem.limits.on_positioning:
        return None
    coarse, _ = sampled(places, COARSE)
    seen = sightings(problem, minimum, coarse)
    bad = coarse[_breaks(problem, seen)]
    close = _near_the_ground(problem, field, seen)
    begins = np.flatnonzero(close[:-1] | close[1:])
    if len(begins):
        share = np.arange(1, round(COARSE / FINE))[:, None, None] * (FINE / COARSE)
        fine = (coarse[begins] + share * (coarse[begins + 1] - coarse[begins])).reshape(-1, 2)
        bad = np.concatenate([bad, fine[_breaks(problem, sightings(problem, minimum, fine))]])
    if len(bad) == 0:
        return None
    reasons = field.reasons.copy()
    rows = np.clip(bad[:, 0].astype(np.intp), 0, reasons.shape[0] - 1)
    cols = np.clip(bad[:, 1].astype(np.intp), 0, reasons.shape[1] - 1)
    reasons[rows, cols] |= bit_of(Reason.SIGHT_LINE)
    return replace(field, reasons=reasons)


def _breaks(problem: PathProblem, seen: Sightings) -> npt.NDArray[np.bool_]:
    limits = problem.limits
    broken = np.zeros(len(seen.dop), np.bool_)
    broken[seen.visible.sum(axis=1) < limits.min_anchors] = True
    if np.isfinite(limits.max_dop):
        broken[~(seen.dop <= limits.max_dop)] = True
    return broken


def _near_the_ground(problem: PathProblem, field: CostField, seen: Sightings) -> npt.NDArray[np.bool_]:
    """Points at which a line in sight clears the ground by little."""
    near_m = NEAR_M_PER_CELL * max(field.grid.cell_east_m, field.grid.cell_north_m)
    return np.asarray((seen.visible & (seen.margin_m < near_m)).any(axis=1))
