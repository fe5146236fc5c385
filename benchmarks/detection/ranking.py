"""How well a score ranks bad ranges above good ones: area under the curve, the curve, shares at a threshold."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["area_under_curve", "caught_at", "curve"]

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


def area_under_curve(score: Floats, bad: Bools) -> float:
    """Probability that a bad range scores above a good one; ties count half (Mann and Whitney)."""
    _, at, counts = np.unique(score, return_inverse=True, return_counts=True)
    ranks = (np.cumsum(counts) - 0.5 * (counts - 1.0))[at.reshape(score.shape)]
    bad_count, good_count = int(bad.sum()), int((~bad).sum())
    return float((ranks[bad].sum() - bad_count * (bad_count + 1) / 2.0) / (bad_count * good_count))


def caught_at(score: Floats, bad: Bools, false_alarms: float) -> float:
    """Share of the bad ranges above the threshold that so large a share of the good ones exceeds."""
    return float((score[bad] > np.quantile(score[~bad], 1.0 - false_alarms)).mean())


def curve(score: Floats, bad: Bools) -> tuple[Floats, Floats]:
    """(false alarms, caught) as shares, at every threshold, from the strictest on."""
    order = np.argsort(-score, kind="stable")
    caught, false_alarms = np.cumsum(bad[order]) / bad.sum(), np.cumsum(~bad[order]) / (~bad).sum()
    return np.append(0.0, false_alarms), np.append(0.0, caught)
