"""When a vehicle stands still, as its own readings tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError
from .samples import ImuLog

__all__ = ["StandstillRule", "standing_still"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class StandstillRule:
    """Still is where over a window both readings hardly change (seed 002, table 5.1: autoZUPT).

    force_sigma_m_per_s2, rate_sigma_rad_per_s: most standard deviation within the window, of each axis about its own
    mean, so that biases do not matter. rate_mean_rad_per_s: most mean turn rate, for a steady turn is no standstill.
    window_s: the seed has 20 readings. Raises MeasurementError.
    """

    force_sigma_m_per_s2: float = 0.05
    rate_sigma_rad_per_s: float = 0.001
    rate_mean_rad_per_s: float = 0.02
    window_s: float = 0.5

    def __post_init__(self) -> None:
        if not min(self.force_sigma_m_per_s2, self.rate_sigma_rad_per_s, self.rate_mean_rad_per_s, self.window_s) > 0.0:
            raise MeasurementError("A rule for standing still needs limits and a window above zero.")


def standing_still(log: ImuLog, rule: StandstillRule | None = None) -> npt.NDArray[np.bool_]:
    """(k,) whether each reading lies within a window of standing still; never beside a gap."""
    asked = StandstillRule() if rule is None else rule
    step_s = float(np.median(np.diff(log.times_s)))
    width = max(round(asked.window_s / step_s), 2)
    if width > len(log.times_s):
        return np.zeros(len(log.times_s), bool)
    quiet = _spread(log.forces_m_per_s2, width) <= asked.force_sigma_m_per_s2
    quiet &= _spread(log.rates_rad_per_s, width) <= asked.rate_sigma_rad_per_s
    quiet &= np.abs(_mean(log.rates_rad_per_s, width)).max(axis=1) <= asked.rate_mean_rad_per_s
    quiet &= _mean(log.gaps[:, None].astype(np.float64), width)[:, 0] == 0.0
    # a reading is still where any quiet window holds it
    edges = np.zeros(len(log.times_s) + 1)
    np.add.at(edges, np.flatnonzero(quiet), 1.0)
    np.add.at(edges, np.flatnonzero(quiet) + width, -1.0)
    still: npt.NDArray[np.bool_] = np.cumsum(edges)[:-1] > 0.5
    return still


def _mean(values: Array, width: int) -> Array:
    """(k - width + 1, c) running means."""
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    means: Array = (sums[width:] - sums[:-width]) / width
    return means


def _spread(values: Array, width: int) -> Array:
    """(k - width + 1,) the largest running standard deviation of all columns."""
    centred = values - values.mean(axis=0)
    variance = _mean(centred**2, width) - _mean(centred, width) ** 2
    spread: Array = np.sqrt(np.maximum(variance, 0.0)).max(axis=1)
    return spread
