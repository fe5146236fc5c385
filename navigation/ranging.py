"""The extended Kalman filter at constant velocity: time passes, ranges come in, together or one by one."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .errors import MeasurementError, TimeOrderError
from .inputs import positions
from .kernels import ranges as kernel
from .motion import MotionNoise
from .states import FilterState

__all__ = ["RangeUpdate", "Verdict", "predict", "update_range", "update_ranges"]

Array = npt.NDArray[np.float64]


class Verdict(enum.IntEnum):
    """What became of a measurement: LEFT_OUT (not measured, not in sight or without weight), USED, GATED, REACQUIRED.

    GATED: its innovation is further out than the gate; it changed nothing. REACQUIRED: so many were gated that the
    belief was lost; it was widened until this range fitted, and the range was used.
    """

    LEFT_OUT = kernel.LEFT_OUT
    USED = kernel.USED
    GATED = kernel.GATED
    REACQUIRED = kernel.REACQUIRED


@dataclass(frozen=True, eq=False)
class RangeUpdate:
    """The state after ranges to k anchors, and what was found of each.

    innovation_m, innovation_variance_m2: (k,) measured less expected range, and its variance; NaN where left out. As
        ranges are taken in one after the other, these are independent of one another.
    verdict: (k,) Verdict, uint8.
    """

    state: FilterState
    innovation_m: Array
    innovation_variance_m2: Array
    verdict: npt.NDArray[np.uint8]

    @property
    def used(self) -> int:
        """How many ranges were used."""
        return int(np.count_nonzero(self.taken))

    @property
    def reacquired(self) -> bool:
        """Whether the belief was found lost, and widened."""
        return bool((self.verdict == Verdict.REACQUIRED).any())

    @property
    def taken(self) -> npt.NDArray[np.bool_]:
        """(k,) which ranges were used."""
        return np.isin(self.verdict, (Verdict.USED, Verdict.REACQUIRED))

    @property
    def nis(self) -> float:
        """Normalised innovations squared of the ranges used, chi-square of ``used`` degrees; NaN where none is."""
        taken = self.taken
        if not taken.any():
            return math.nan
        return float((self.innovation_m[taken] ** 2 / self.innovation_variance_m2[taken]).sum())


def predict(state: FilterState, time_s: float, motion: MotionNoise) -> FilterState:
    """The belief at a later time (De Vivo et al., eqs. 28, 30, 31); a long outage inflates it, up to 1000 km.

    Raises TimeOrderError.
    """
    step_s = float(time_s) - state.time_s
    if not step_s >= 0.0 or math.isinf(step_s):
        raise TimeOrderError(f"time_s must not go backwards: {time_s} s follows {state.time_s} s.")
    mean, covariance = state.mean.copy(), state.covariance.copy()
    kernel.advance(mean, covariance, step_s, motion.psd())
    return FilterState(float(time_s), mean, covariance, state.doubt)


def update_ranges(
    state: FilterState,
    anchors_m: npt.ArrayLike,
    measured_m: npt.ArrayLike,
    variances_m2: npt.ArrayLike,
    *,
    gate_sigma: float = math.inf,
) -> RangeUpdate:
    """The belief after ranges of one instant (eqs. 32-35); with a clock in the state they are pseudoranges.

    anchors_m: (k, 3) east, north, up. measured_m: (k,), NaN = not measured. variances_m2: (k,) or one for all, inf =
        left out (``range_variances_m2`` makes them). gate_sigma: an innovation further out is not believed,
        until a belief that hardly any range fits is found lost (REACQUIRED).
    The paper's eq. 34 repeats each derivative times Δt in the columns of the velocity; the range at an instant depends
    on the position at that instant only, so those are 0 here. Raises MeasurementError.
    """
    anchors = positions("anchors_m", anchors_m)
    count = anchors.shape[0]
    measured = np.array(measured_m, np.float64)
    variances = np.array(variances_m2, np.float64)
    if variances.ndim == 0:
        variances = np.full(count, variances)
    if measured.shape != (count,) or variances.shape != (count,):
        raise MeasurementError(
            f"{count} anchors need as many measured_m and variances_m2, not {measured.shape} and {variances.shape}."
        )
    if np.isinf(measured).any():
        raise MeasurementError("measured_m must hold finite numbers, or NaN for what was not measured.")
    if not (variances > 0.0).all():
        raise MeasurementError("variances_m2 must be above zero, inf for ranges to leave out.")
    if not gate_sigma > 0.0:
        raise MeasurementError(f"gate_sigma must be above zero, not {gate_sigma}.")
    mean, covariance = state.mean.copy(), state.covariance.copy()
    found = np.zeros((count, 3))
    gate = float(gate_sigma) ** 2, np.array([state.doubt])
    kernel.update_ranges(mean, covariance, anchors, measured, variances, gate, found)
    updated = FilterState(state.time_s, mean, covariance, float(gate[1][0]))
    return RangeUpdate(updated, found[:, 0].copy(), found[:, 1].copy(), found[:, 2].astype(np.uint8))


def update_range(
    state: FilterState,
    time_s: float,
    motion: MotionNoise,
    anchor_m: npt.ArrayLike,
    measured_m: float,
    variance_m2: float,
    *,
    gate_sigma: float = math.inf,
) -> RangeUpdate:
    """The belief after a single range at its own time: how a rover takes in ranges that arrive one by one.

    Raises MeasurementError, TimeOrderError.
    """
    here = predict(state, time_s, motion)
    anchors = np.atleast_2d(np.asarray(anchor_m, np.float64))
    return update_ranges(here, anchors, [measured_m], [variance_m2], gate_sigma=gate_sigma)
