"""What satellites correct an inertial solution by: pseudoranges, and how carrier phases change from epoch to epoch."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError
from ..inputs import numbers, positions
from .kernels import corrections as kernel
from .measurements import Measurements, ranges_to_anchors

__all__ = ["phase_changes", "pseudoranges"]

# 2σ²·(1 - cos ω), the spectrum of differences of white noise σ², is at most that
OVERBOUND = 4.0


def pseudoranges(
    times_s: npt.ArrayLike,
    satellites_m: npt.ArrayLike,
    measured_m: npt.ArrayLike,
    sigmas_m: npt.ArrayLike,
    *,
    sight: npt.ArrayLike = 1.0,
    least_sight: float = 0.1,
    gate_sigma: float = math.inf,
) -> Measurements:
    """Ranges to satellites (n, 3) with the receiver's clock in them, corrected for theirs and the atmosphere.

    satellites_m: in the frame of the instant when the signal comes in. Else as ``ranges_to_anchors``, which has no
    clock. Raises MeasurementError.
    """
    found = ranges_to_anchors(
        times_s, satellites_m, measured_m, sigmas_m, sight=sight, least_sight=least_sight, gate_sigma=gate_sigma
    )
    return replace(found, kinds=np.full(len(found), kernel.PSEUDORANGE, np.int64))


def phase_changes(
    times_s: npt.ArrayLike,
    satellites: npt.ArrayLike,
    satellites_m: npt.ArrayLike,
    phases_m: npt.ArrayLike,
    sigmas_m: npt.ArrayLike,
    *,
    arcs: npt.ArrayLike = 0,
    gate_sigma: float = math.inf,
) -> Measurements:
    """How carrier phases have changed since the epoch before, by motion and the receiver's clock (seed 002, eq. 2.2).

    Row by row, in order of time: satellites (n,) whole numbers, satellites_m (n, 3) where each was when it sent, in the
    frame of the instant when the signal comes in; phases_m (n,) cycles times wavelength, corrected for the satellites'
    clocks, NaN = none; sigmas_m (n,) or one, of a phase; arcs (n,) or one, whole numbers: where a satellite's changes,
    whole cycles were lost and nothing is told. One that the epoch before has not is NaN. Differences that share a phase
    correlate by -0.5; each has the variance 4σ², the most that the spectrum of 2σ² with that correlation reaches, so
    that nothing is believed too far. Raises MeasurementError.
    """
    places = positions("satellites_m", satellites_m)
    shape = (len(places),)
    times, phases = numbers("times_s", times_s, shape), numbers("phases_m", phases_m, shape)
    number, arc = np.asarray(satellites), np.broadcast_to(np.asarray(arcs), shape)
    if number.shape != shape or number.dtype.kind not in "iu" or arc.dtype.kind not in "iu":
        raise MeasurementError("satellites and arcs must be whole numbers, one for each phase.")
    if (np.diff(times) < 0.0).any():
        raise MeasurementError("Phases must be in order of time.")
    changes, before_m = np.full(shape, math.nan), places.copy()
    epoch_of = np.unique(times, return_inverse=True)[1] if len(times) else np.zeros(0, np.int64)
    latest: dict[int, int] = {}
    for row, (one, epoch) in enumerate(zip(number.tolist(), epoch_of.tolist(), strict=True)):
        last = latest.get(one)
        if last is not None and epoch_of[last] == epoch:
            raise MeasurementError(f"Satellite {one} has two phases at {times[row]} s.")
        if last is not None and epoch_of[last] == epoch - 1 and arc[last] == arc[row]:
            changes[row], before_m[row] = phases[row] - phases[last], places[last]
        latest[one] = row
    sigmas = math.sqrt(OVERBOUND) * numbers("sigmas_m", np.broadcast_to(sigmas_m, shape), shape)
    found = ranges_to_anchors(times, places, changes, sigmas, gate_sigma=gate_sigma)
    return replace(found, kinds=np.full(len(found), kernel.PHASE_CHANGE, np.int64), offsets_m=before_m)
