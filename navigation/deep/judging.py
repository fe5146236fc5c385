"""Which of an epoch's satellites to believe: parity among them, then the filter's own foresight; and no clock."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..monitor import EpochVerdict, Use, judge_epochs, prediction_check

__all__ = ["Judged", "judge"]

Array = npt.NDArray[np.float64]
SURE = (EpochVerdict.CLEAR, EpochVerdict.EXPLAINED)
ENOUGH = 6  # satellites: two more than parity needs to be sure of itself


@dataclass(frozen=True, eq=False)
class Judged:
    """What is kept (m,) of an epoch, and the same without the clock, independent and of unit sigma.

    rows (k, 3) times what the filter errs by = values (k,). clock: what all have in common, weighted; NaN = none kept.
    """

    kept: npt.NDArray[np.bool_]
    rows: Array
    values: Array
    clock: float


def judge(
    rows: Array,
    off: Array,
    sigmas: Array,
    covariance: Array,
    *,
    monitored: bool = True,
    false_alarm: float = 1e-3,
    limit_sigma: float = 3.5,
) -> Judged:
    """Measurements off (m,) from what the filter foretells, of sigmas (m,), inf = none, and of one unknown clock.

    rows: (m, 3) derivatives by what the filter errs by, of covariance (3, 3). monitored: parity leaves out the fewest
    that disagree (``judge_epochs``), with what the filter foretells as three more measurements unless it is these that
    disagree; then each must lie where the filter allows it (``prediction_check``); where six or more agree with one
    another, and the filter with less than half of them, it is the filter that is wrong. Without monitor all are kept.
    Raises MeasurementError, StateError.
    """
    kept = np.isfinite(sigmas)
    if monitored and kept.sum() >= 2:
        with_clock = np.column_stack([rows, np.ones(len(rows))])
        found = judge_epochs(with_clock[None], off[None], sigmas[None], false_alarm=false_alarm)
        alone = found.verdict[0] in SURE
        use = _use_beside(with_clock, off, sigmas, covariance, false_alarm)
        if use is None and found.verdict[0] in (*SURE, EpochVerdict.AMBIGUOUS):
            use = found.use[0]
        if use is not None:
            kept &= use == Use.KEPT
        middle = _median(off[kept], sigmas[kept])
        foreseen = kept & prediction_check(
            np.where(kept, off - middle, np.nan),
            rows,
            covariance,
            np.where(kept, sigmas, 1.0),
            differences=False,
            limit_sigma=limit_sigma,
        )
        if not (alone and kept.sum() >= ENOUGH and foreseen.sum() < 0.5 * kept.sum()):
            kept = foreseen
    weights = 1.0 / sigmas[kept]
    if not len(weights):
        return Judged(kept, np.zeros((0, 3)), np.zeros(0), math.nan)
    clock = float(weights**2 @ off[kept] / (weights**2).sum())
    # of the weighted equations those combinations in which the clock does not enter
    free = np.linalg.svd(weights[:, None])[0][:, 1:].T
    return Judged(kept, free @ (weights[:, None] * rows[kept]), free @ (weights * off[kept]), clock)


def _use_beside(
    with_clock: Array, off: Array, sigmas: Array, covariance: Array, false_alarm: float
) -> npt.NDArray[np.uint8] | None:
    """(m,) Use by parity with foresight as three more measurements; None where these disagree, or nothing is told."""
    foresight = np.column_stack([np.linalg.inv(np.linalg.cholesky(covariance)), np.zeros(3)])
    table, values = np.vstack([with_clock, foresight]), np.append(off, np.zeros(3))
    found = judge_epochs(table[None], values[None], np.append(sigmas, np.ones(3))[None], false_alarm=false_alarm)
    if found.verdict[0] not in SURE or (found.use[0, -3:] != Use.KEPT).any():
        return None
    use: npt.NDArray[np.uint8] = found.use[0, :-3]
    return use


def _median(values: Array, sigmas: Array) -> float:
    """Half of the weight to either side: a clock that a few wrong satellites do not move."""
    if not len(values):
        return math.nan
    order = np.argsort(values)
    share = np.cumsum(sigmas[order] ** -2.0)
    return float(values[order][np.searchsorted(share, 0.5 * share[-1])])
