"""When a rover gets where, for maps that change with time."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from planning.kernels.path_grid import costs_from
from planning.questions.problems import PathProblem

from .ends import square_ends
from .fields import CostField, KernelField, running_sums
from .places import sampled

__all__ = ["arrivals_along", "fastest_arrivals_s"]

Times = npt.NDArray[np.float64]

# squares this near a path are met when the path is there
BESIDE = 2


def fastest_arrivals_s(problem: PathProblem, field: CostField) -> Times:
    """(rows - 1, cols - 1) soonest arrival over what the ground and the areas allow; +inf = never."""
    timed = _timed(field)
    row, col = problem.grid.post_at(*problem.start)
    ends = square_ends(timed, row, col, True)
    arrival_s: Times = costs_from(timed, ends.nodes, ends.costs).reshape(field.reasons.shape)
    return arrival_s


def arrivals_along(field: CostField, fastest_s: Times, places: npt.NDArray[np.float64]) -> Times:
    """Arrivals when a path is taken: its own times on it and beside it, elsewhere the soonest, as much later."""
    fine, _ = sampled(places, 1.0)
    times_s = running_sums(field.for_kernels(), fine)[:, 2]
    rows, cols = np.minimum(fine.astype(np.intp), np.array(field.reasons.shape) - 1).T
    soonest_s = fastest_s[rows, cols]
    some = np.isfinite(soonest_s) & (soonest_s > 0.0)
    later = float(np.median(times_s[some] / soonest_s[some])) if some.any() else 1.0
    arrival_s = fastest_s * max(later, 1.0)
    for down in range(-BESIDE, BESIDE + 1):
        for across in range(-BESIDE, BESIDE + 1):
            r = np.clip(rows + down, 0, field.reasons.shape[0] - 1)
            c = np.clip(cols + across, 0, field.reasons.shape[1] - 1)
            known = np.isfinite(arrival_s[r, c])
            arrival_s[r[known], c[known]] = times_s[known]
    return arrival_s


def _timed(field: CostField) -> KernelField:
    """The field whose cost is seconds, and where anchors forbid nothing."""
    heights_m, _, added, hidden, cells, numbers, pace = field.for_kernels()
    allowed = (field.obstacles() == 0).astype(np.uint8)
    timed = (float(pace.min()), *numbers[1:4], 0.0, 0.0, 1.0, 0.0)
    return heights_m, allowed, np.zeros_like(added), np.zeros_like(hidden), cells, timed, pace
