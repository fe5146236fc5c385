"""A log of ranges, each at its own time, through the filter in one go."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .errors import MeasurementError, TimeOrderError
from .inputs import numbers, positions
from .kernels.tracks import filter_events
from .motion import MotionNoise
from .states import FilterState

__all__ = ["FilteredLog", "filter_ranges"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FilteredLog:
    """What the filter believed after each of m ranges.

    mean: (m, 6), with a clock (m, 8). position_covariance_m2: (m, 3, 3). innovation_m, innovation_variance_m2: (m,).
    verdict: (m,) Verdict, uint8. state: the last belief.
    """

    mean: Array
    position_covariance_m2: Array
    innovation_m: Array
    innovation_variance_m2: Array
    verdict: npt.NDArray[np.uint8]
    state: FilterState

    @property
    def position_m(self) -> Array:
        """(m, 3) east, north, up."""
        return self.mean[:, [0, 2, 4]]


def filter_ranges(
    state: FilterState,
    motion: MotionNoise,
    times_s: npt.ArrayLike,
    anchor_numbers: npt.ArrayLike,
    measured_m: npt.ArrayLike,
    variances_m2: npt.ArrayLike,
    anchors_m: npt.ArrayLike,
    *,
    gate_sigma: float = math.inf,
) -> FilteredLog:
    """The filter over m ranges, one by one: what ``update_range`` would do in a loop, compiled.

    times_s: (m,), from the state's time on, never backwards. anchor_numbers: (m,) rows of anchors_m (k, 3).
    measured_m: (m,), NaN = none came. variances_m2: (m,) or one for all, inf = left out.
    Raises MeasurementError, TimeOrderError.
    """
    anchors = positions("anchors_m", anchors_m)
    count = np.size(times_s)
    times = numbers("times_s", times_s, (count,))
    measured = numbers("measured_m", measured_m, (count,))
    variances = numbers("variances_m2", np.broadcast_to(variances_m2, (count,)), (count,))
    which = np.array(anchor_numbers)
    if which.shape != (count,) or which.dtype.kind not in "iu":
        raise MeasurementError(f"anchor_numbers must be {count} whole numbers, not {which.dtype} {which.shape}.")
    if count and not (which.min() >= 0 and which.max() < len(anchors)):
        raise MeasurementError(f"anchor_numbers must name one of {len(anchors)} anchors, 0 the first.")
    if np.isinf(measured).any() or not (variances > 0.0).all() or not gate_sigma > 0.0:
        raise MeasurementError("measured_m must be finite or NaN; variances_m2 and gate_sigma above zero.")
    whole = np.concatenate([[state.time_s], times])
    back = ~(np.diff(whole) >= 0.0) | ~np.isfinite(times)
    if back.any():
        first = int(np.argmax(back))
        raise TimeOrderError(
            f"times_s must not go backwards: {whole[first + 1]} s follows {whole[first]} s at range {first}.",
            index=first,
        )
    # the belief before the first range goes in front, as an event without a range
    events = (
        whole,
        np.concatenate([[0], which]).astype(np.int64),
        np.concatenate([[math.nan], measured]),
        np.concatenate([[math.inf], variances]),
    )
    mean, covariance = state.mean.copy(), state.covariance.copy()
    means, covariances = np.zeros((count + 1, mean.size)), np.zeros((count + 1, 3, 3))
    found = np.zeros((count + 1, 3))
    gate = float(gate_sigma) ** 2, np.array([state.doubt])
    filter_events(mean, covariance, events, anchors, motion.psd(), gate, (means, covariances), found)
    last = FilterState(float(whole[-1]), mean, covariance, float(gate[1][0]))
    rest = found[1:]
    return FilteredLog(means[1:], covariances[1:], rest[:, 0], rest[:, 1], rest[:, 2].astype(np.uint8), last)
