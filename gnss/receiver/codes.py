"""The coarse/acquisition codes of GPS L1 (IS-GPS-200, section 3.3.2.3)."""

from __future__ import annotations

import functools

import numpy as np
import numpy.typing as npt

from gnss.errors import GnssInputError

__all__ = ["CHIPS", "CHIP_RATE_HZ", "L1_HZ", "PRNS", "SPEED_OF_LIGHT_M_PER_S", "ca_code"]

CHIPS = 1023
CHIP_RATE_HZ = 1.023e6
L1_HZ = 1575.42e6
SPEED_OF_LIGHT_M_PER_S = 299_792_458.0
STAGES = 10
# stages of the second register whose sum delays it for each satellite (table 3-Ia)
TAPS = (
    *((2, 6), (3, 7), (4, 8), (5, 9), (1, 9), (2, 10), (1, 8), (2, 9), (3, 10), (2, 3), (3, 4)),
    *((5, 6), (6, 7), (7, 8), (8, 9), (9, 10), (1, 4), (2, 5), (3, 6), (4, 7), (5, 8), (6, 9)),
    *((1, 3), (4, 6), (5, 7), (6, 8), (7, 9), (8, 10), (1, 6), (2, 7), (3, 8), (4, 9)),
)
PRNS = tuple(range(1, len(TAPS) + 1))


@functools.cache
def ca_code(prn: int) -> npt.NDArray[np.float32]:
    """(1023,) chips of a satellite, read-only: +1 where the code has a 0, -1 where it has a 1.

    prn: 1 to 32. Raises GnssInputError.
    """
    if prn not in PRNS:
        raise GnssInputError(f"A C/A code belongs to a PRN of 1 to {len(PRNS)}, not {prn}.")
    first, second = [1] * STAGES, [1] * STAGES
    one, other = TAPS[prn - 1]
    chips = np.empty(CHIPS, np.float32)
    for chip in range(CHIPS):
        chips[chip] = 1 - 2 * (first[-1] ^ second[one - 1] ^ second[other - 1])
        first = [first[2] ^ first[9], *first[:-1]]
        fed = second[1] ^ second[2] ^ second[5] ^ second[7] ^ second[8] ^ second[9]
        second = [fed, *second[:-1]]
    chips.setflags(write=False)
    return chips
