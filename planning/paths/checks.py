"""Limits that a field of squares cannot judge, along one path: exact sight lines, and the safety bubble.

Squares in which a path breaks one are taken out of the field, and the path is planned again.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import scipy

from planning.kernels.path_fields import clearances
from planning.questions.limits import PathLimits
from planning.questions.problems import PathProblem
from planning.validation import PathValidation

from .describing import described
from .fields import CostField, bit_of, running_sums
from .outcomes import Path, Reason
from .places import sampled
from .sight_maps import Sightings, SightMaps

__all__ = ["breaks", "hidden_places", "without_broken_squares", "without_refused_squares"]

Floats = npt.NDArray[np.float64]

# how closely sight lines are asked along a path, in cells: everywhere, and where a line that counts is near the ground
COARSE, FINE = 0.5, 0.0625
NEAR_M_PER_CELL = 0.25
# limits, as the validator calls them, that a path around the place keeps
REPAIRED = ("anchors in sight", "dilution", "height over the morphing map", "room for the safety bubble")


def without_broken_squares(
    problem: PathProblem, field: CostField, maps: SightMaps | None, places: Floats
) -> CostField | None:
    """The field without the squares in which a path breaks a limit on positioning; None where it breaks none."""
    if maps is None or not problem.limits.on_positioning:
        return None
    hidden = hidden_places(problem, field, maps, places)
    if len(hidden):
        return _without(field, hidden[:, 0].astype(np.intp), hidden[:, 1].astype(np.intp), Reason.SIGHT_LINE)
    if problem.limits.bubble_epsilon == 0.0:
        return None
    return _without_tight(problem, field, described(problem, field, maps, places), places)


def without_refused_squares(field: CostField, validation: PathValidation) -> CostField | None:
    """The field without the squares where the validator found a limit on sight broken; None where that is not it."""
    first_m = [check.first_m for check in validation.failures if str(check.limit) in REPAIRED]
    posts = [field.square_at(*field.grid.post_at(*place)) for place in first_m if place is not None]
    if len(posts) == 0 or len(posts) < len(validation.failures):
        return None
    rows, cols = np.array(posts, np.intp).T
    return _without(field, rows, cols, Reason.SIGHT_LINE)


def _without(field: CostField, rows: npt.NDArray[np.intp], cols: npt.NDArray[np.intp], reason: Reason) -> CostField:
    reasons = field.reasons.copy()
    reasons[np.clip(rows, 0, reasons.shape[0] - 1), np.clip(cols, 0, reasons.shape[1] - 1)] |= bit_of(reason)
    return replace(field, reasons=reasons)


def hidden_places(
    problem: PathProblem, field: CostField, maps: SightMaps | None, places: Floats, *, everywhere: bool = False
) -> Floats:
    """Places along a path at which exact sight lines break a limit; everywhere: over forbidden squares, too."""
    if maps is None or not problem.limits.on_positioning:
        return np.zeros((0, 2))
    coarse, _ = sampled(places, COARSE)
    times_s = running_sums(field.for_kernels(everywhere=everywhere), coarse)[:, 2]
    seen = maps.sightings(coarse, times_s)
    hidden = coarse[breaks(problem.limits, seen)]
    near_m = NEAR_M_PER_CELL * max(field.grid.cell_east_m, field.grid.cell_north_m)
    close = np.asarray((seen.visible & (seen.margin_m < near_m)).any(axis=1))
    begins = np.flatnonzero(close[:-1] | close[1:])
    if len(begins) == 0:
        return hidden
    share = np.arange(1, round(COARSE / FINE))[:, None] * (FINE / COARSE)
    fine = (coarse[begins] + share[..., None] * (coarse[begins + 1] - coarse[begins])).reshape(-1, 2)
    fine_s = (times_s[begins] + share * (times_s[begins + 1] - times_s[begins])).ravel()
    return np.concatenate([hidden, fine[breaks(problem.limits, maps.sightings(fine, fine_s))]])


def breaks(limits: PathLimits, seen: Sightings) -> npt.NDArray[np.bool_]:
    """(n,) whether limits on positioning are broken at the points that were looked at."""
    broken = np.zeros(len(seen.dop), np.bool_)
    broken[seen.visible.sum(axis=1) < limits.min_anchors] = True
    if math.isfinite(limits.dop_limit):
        broken[~(seen.dop < limits.dop_limit)] = True
    return broken


def _without_tight(problem: PathProblem, field: CostField, path: Path, places: Floats) -> CostField | None:
    """The field without squares whose surroundings are tighter than the bubble that the path has near them."""
    tight = np.flatnonzero(path.clearance_m < path.bubble_radius_m)
    if len(tight) == 0:
        return None
    fine, _ = sampled(places, 1.0)
    rows = np.minimum(fine[tight, 0].astype(np.intp), field.reasons.shape[0] - 1)
    cols = np.minimum(fine[tight, 1].astype(np.intp), field.reasons.shape[1] - 1)
    radius_m = np.zeros(field.reasons.shape)
    np.maximum.at(radius_m, (rows, cols), path.bubble_radius_m[tight])
    around = [
        2 * math.ceil(2.0 * radius_m.max() / cell_m) + 1 for cell_m in (field.grid.cell_north_m, field.grid.cell_east_m)
    ]
    radius_m = scipy.ndimage.maximum_filter(radius_m, size=[min(size, 201) for size in around])
    near_rows, near_cols = np.nonzero(radius_m)
    clearance_m = np.empty(len(near_rows))
    middles = np.column_stack([near_rows, near_cols]) + 0.5
    clearances(field.obstacles(), field.for_kernels()[4], middles, clearance_m)
    narrow = clearance_m < radius_m[near_rows, near_cols]
    without = _without(field, near_rows[narrow], near_cols[narrow], Reason.BUBBLE)
    return _without(without, rows, cols, Reason.BUBBLE)
