"""Samples of GPS L1 C/A as a front end would record them, by the definition (IS-GPS-200), and none of our code.

A code is made with the second register delayed (table 3-Ia, "code delay"), where the product adds two of its stages.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

CHIPS, CHIP_RATE_HZ, L1_HZ, C = 1023, 1.023e6, 1575.42e6, 299_792_458.0
# chips by which G2 is delayed, PRN 1 to 32
DELAYS = (
    *(5, 6, 7, 8, 17, 18, 139, 140, 141, 251, 252, 254, 255, 256, 257, 258),
    *(469, 470, 471, 472, 473, 474, 509, 512, 513, 514, 515, 516, 859, 860, 861, 862),
)
# the first ten chips in octal, PRN 1 to 32 (table 3-Ia)
FIRST_TEN = (
    *("1440", "1620", "1710", "1744", "1133", "1455", "1131", "1454", "1626", "1504", "1642", "1750", "1764", "1772"),
    *("1775", "1776", "1156", "1467", "1633", "1715", "1746", "1763", "1063", "1706", "1743", "1761", "1770", "1774"),
    *("1127", "1453", "1625", "1712"),
)


def register(taps: tuple[int, ...]) -> npt.NDArray[np.int64]:
    """1023 outputs of a ten-stage register that begins with ones."""
    stages, out = [1] * 10, list[int]()
    for _ in range(CHIPS):
        out.append(stages[9])
        fed = sum(stages[tap - 1] for tap in taps) % 2
        stages = [fed, *stages[:9]]
    return np.array(out)


def code(prn: int) -> npt.NDArray[np.int64]:
    """(1023,) +1 for a 0, -1 for a 1."""
    return 1 - 2 * (register((3, 10)) ^ np.roll(register((2, 3, 6, 8, 9, 10)), DELAYS[prn - 1]))


def signal(
    prn: int,
    delays_s: Array,
    rate_hz: float,
    cn0_db_hz: float,
    bits: npt.ArrayLike | None = None,
    phase_rad: float = 0.0,
    start_s: float = 0.0,
) -> Complex:
    """Complex samples of one satellite over noise of unit power, which is not added.

    delays_s: (n,) from the satellite's clock to the sample, at start_s, start_s + 1/rate ...: the sample is what was
    sent delay earlier. bits: of 20 ms each, the first from the satellite's time 0 on, +-1.
    """
    sent_s = start_s + np.arange(len(delays_s)) / rate_hz - delays_s
    chips = code(prn)[np.floor(sent_s * CHIP_RATE_HZ).astype(np.int64) % CHIPS]
    sent_bits = np.ones(1) if bits is None else np.asarray(bits)
    data = sent_bits[np.floor(sent_s / 0.02).astype(np.int64) % len(sent_bits)]
    amplitude = np.sqrt(10.0 ** (cn0_db_hz / 10.0) / rate_hz)
    made: Complex = amplitude * data * chips * np.exp(1j * (phase_rad - 2.0 * np.pi * (L1_HZ * delays_s % 1.0)))
    return made


def noise(rng: np.random.Generator, count: int) -> Complex:
    """(count,) complex, of unit power."""
    drawn: Complex = (rng.normal(size=count) + 1j * rng.normal(size=count)) / np.sqrt(2.0)
    return drawn
