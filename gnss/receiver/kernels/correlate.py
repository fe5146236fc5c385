"""Samples times a replica, summed over code periods, for several delays at once."""

import math
from typing import NamedTuple

import numpy as np

from compiled.options import scalar_kernel

__all__ = ["QUARTERS", "Periods", "correlate"]

QUARTERS = 4


class Periods(NamedTuple):
    """Code periods (p,): their first sample (p + 1,), and there the chip and the carrier's turns, with their steps."""

    first: np.ndarray
    chips: np.ndarray
    chips_per_sample: np.ndarray
    turns: np.ndarray
    turns_per_sample: np.ndarray


@scalar_kernel
def correlate(values, code, periods, taps, sums):
    """Fill sums (b, k): samples times the code, later by taps (k,) quarters of a chip, times the conjugate carrier.

    Each sum takes as many periods as there are for one. Samples of one quarter of a chip are added first, over all of
    them, so that the code is multiplied once for a sum.
    """
    count = QUARTERS * code.shape[0]
    each = periods.chips.shape[0] // sums.shape[0]
    quarters = np.empty(count, np.complex128)
    for b in range(sums.shape[0]):
        quarters[:] = 0.0
        for p in range(b * each, (b + 1) * each):
            angle = -2.0 * math.pi * periods.turns[p]
            step = -2.0 * math.pi * periods.turns_per_sample[p]
            carrier, turn = complex(math.cos(angle), math.sin(angle)), complex(math.cos(step), math.sin(step))
            chip, chips = QUARTERS * periods.chips[p], QUARTERS * periods.chips_per_sample[p]
            for n in range(periods.first[p], periods.first[p + 1]):
                place = int(chip)
                quarters[place if place < count else place - count] += values[n] * carrier
                carrier *= turn
                chip += chips
        for k in range(taps.shape[0]):
            total = 0.0 + 0.0j
            place = count - taps[k]
            for q in range(count):
                total += quarters[q] * code[((place + q) % count) // QUARTERS]
            sums[b, k] = total
