"""A strong satellite taken out of samples: its code resembles the others' by -21 dB and would be found as theirs."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import numpy.typing as npt

from .codes import CHIP_RATE_HZ, CHIPS, L1_HZ, ca_code
from .samples import Samples

__all__ = ["replica", "without_satellite"]

TRIED = 33  # frequencies within a step of the search to either side


def replica(prn: int, chips_per_sample: float, first: float, count: int) -> npt.NDArray[np.float32]:
    """(count,) chips at samples first, first + 1 ... after a period's beginning; first may be negative."""
    chips = np.floor((first + np.arange(count)) * chips_per_sample).astype(np.int64) % CHIPS
    values: npt.NDArray[np.float32] = ca_code(prn)[chips]
    return values


def without_satellite(
    samples: Samples, prn: int, code_start_sample: int, doppler_hz: float, within_hz: float
) -> Samples:
    """The samples less what one satellite can explain of them, each code period by its own least squares.

    Replicas up to one chip early and late are fitted together, so that filters and fractions of samples leave nothing.
    doppler_hz: as found; it is refined by up to within_hz.
    """
    rate = samples.rate_hz
    period = rate / CHIP_RATE_HZ * CHIPS
    values = samples.values.copy()
    starts = np.round(np.arange(code_start_sample % period - period, len(values), period)).astype(np.int64)
    edges = np.unique(np.clip([0, *starts, len(values)], 0, len(values)))
    frequency_hz, chip_rate_hz = samples.intermediate_hz + doppler_hz, CHIP_RATE_HZ * (1.0 + doppler_hz / L1_HZ)
    code = replica(prn, chip_rate_hz / rate, -code_start_sample, len(values))
    t = np.arange(len(values)) / rate
    offsets = np.linspace(-within_hz, within_hz, TRIED)
    wiped = values * code * np.exp(-2j * np.pi * frequency_hz * t)
    turning = np.exp(-2j * np.pi * offsets[:, None] * t)
    sums = np.add.reduceat(turning * wiped, edges[:-1], axis=1)
    best = offsets[int(np.argmax((np.abs(sums) ** 2).sum(axis=1)))]
    carrier = np.exp(2j * np.pi * (frequency_hz + best) * t)
    chip = int(np.ceil(rate / CHIP_RATE_HZ))
    early_to_late = range(-chip, chip + 1)
    shifted = [replica(prn, chip_rate_hz / rate, -code_start_sample - k, len(values)) for k in early_to_late]
    columns = np.stack(shifted, axis=1)
    for begin, end in itertools.pairwise(edges):
        drift = np.linspace(-1.0, 1.0, end - begin)[:, None]
        table = np.hstack([columns[begin:end], drift * columns[begin:end]]) * carrier[begin:end, None]
        fitted, *_ = np.linalg.lstsq(table, values[begin:end].astype(np.complex128), rcond=None)
        values[begin:end] -= (table @ fitted).astype(np.complex64)
    return dataclasses.replace(samples, values=values, warnings=())
