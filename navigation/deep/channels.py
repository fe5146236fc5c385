"""What one interval of a receiver's channels says beside the replicas that its filter foretold."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gnss.receiver import BitSums, ChannelMeasurement, measure_sums

__all__ = ["LIGHT_M_PER_S", "WAVELENGTH_M", "Heard", "combined", "heard"]

Array = npt.NDArray[np.float64]
LIGHT_M_PER_S = 299_792_458.0
WAVELENGTH_M = LIGHT_M_PER_S / 1575.42e6
LEAST_SHARE = 0.1


@dataclass(frozen=True)
class Heard:
    """A satellite in one interval, as ranges beyond those of its replica, metres; sigma inf = not measured.

    range_m: by the code. rate_m_per_s: by the carrier's frequency. phase_m: by its phase, right up to half waves.
    detected, sums: how many of how many sums were above the threshold. cn0_db_hz: median of those detected, NaN = none.
    """

    prn: int
    range_m: float
    range_sigma_m: float
    rate_m_per_s: float
    rate_sigma_m_per_s: float
    phase_m: float
    phase_sigma_m: float
    detected: int
    sums: int
    cn0_db_hz: float


def heard(sums: BitSums, bits: int, reach_hz: float, false_alarm: float) -> Heard:
    """An interval's bits, summed so many at a time, each sum judged by itself; those detected together."""
    parts = [sums.part(first, bits) for first in range(0, len(sums) - bits + 1, bits)]
    measured = [measure_sums(part, reach_hz=reach_hz, false_alarm=false_alarm) for part in parts]
    return combined(sums.prn, measured)


def combined(prn: int, measured: Sequence[ChannelMeasurement]) -> Heard:
    """The sums that were detected, weighed by their sigmas: ranges and phases about the interval's middle.

    Where fewer than a tenth were, noise may have been, and nothing is measured. Phases are doubled for their mean, so
    that half cycles go; where each sum is one bit, which tells no frequency, it is that by which the doubled phases
    turn from sum to sum.
    """
    seen = [one for one in measured if one.detected and math.isfinite(one.delay_sigma_s)]
    if len(seen) < LEAST_SHARE * len(measured) or not seen:
        return Heard(prn, 0.0, math.inf, 0.0, math.inf, 0.0, math.inf, len(seen), len(measured), math.nan)
    weights = np.array([one.delay_sigma_s for one in seen]) ** -2.0
    late_s = float(weights @ [one.delay_s - one.replica_delay_s for one in seen]) / float(weights.sum())
    sure = np.array([one.phase_sigma_rad for one in seen]) ** -2.0
    doubled = np.exp(2j * np.array([one.phase_rad for one in seen]))
    phase_rad = 0.5 * float(np.angle(sure @ doubled))
    rate, rate_sigma = _rate_hz(seen, doubled, sure)
    return Heard(
        prn,
        LIGHT_M_PER_S * late_s,
        LIGHT_M_PER_S / math.sqrt(float(weights.sum())),
        -WAVELENGTH_M * rate,
        WAVELENGTH_M * rate_sigma,
        -WAVELENGTH_M * phase_rad / (2.0 * math.pi),
        WAVELENGTH_M / (2.0 * math.pi * math.sqrt(float(sure.sum()))),
        len(seen),
        len(measured),
        float(np.median([one.cn0_db_hz for one in seen])),
    )


def _rate_hz(
    seen: Sequence[ChannelMeasurement], doubled: npt.NDArray[np.complex128], sure: Array
) -> tuple[float, float]:
    """(frequency beyond the replica's, its sigma); inf where nothing tells it."""
    told = [one for one in seen if math.isfinite(one.frequency_sigma_hz)]
    if told:
        weights = np.array([one.frequency_sigma_hz for one in told]) ** -2.0
        mean = float(weights @ [one.frequency_offset_hz for one in told]) / float(weights.sum())
        return mean, 1.0 / math.sqrt(float(weights.sum()))
    middles = np.array([one.middle_s for one in seen])
    next_to = np.flatnonzero(np.diff(middles) < 1.5 * seen[0].duration_s)
    if len(next_to) < 3:
        return 0.0, math.inf
    step_s = seen[0].duration_s
    turned = np.angle((doubled[next_to + 1] * doubled[next_to].conj()).sum())
    sigma = math.sqrt(2.0 / (float(np.mean(sure)) * len(next_to))) / (2.0 * math.pi * step_s)
    return float(turned) / (4.0 * math.pi * step_s), sigma
