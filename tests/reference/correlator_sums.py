"""What an aided correlator gives, in closed form: a triangle over delay, a sinc over frequency, and correlated noise.

Beside samples of the signal itself (``gps_signals``) this is ten thousand times cheaper; that both say the same is
tested in tests/gnss/receiver/test_correlator_sums.py.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
CHIP_RATE_HZ, L1_HZ, BIT_S = 1.023e6, 1575.42e6, 0.02
TAPS = np.arange(-4, 5) / 4.0


def peak(chips: Array) -> Array:
    """Correlation of a code with itself so many chips later, without its side lobes."""
    height: Array = np.maximum(1.0 - np.abs(chips), 0.0)
    return height


ROOT = np.linalg.cholesky(peak(TAPS[:, None] - TAPS) + 1e-9 * np.eye(len(TAPS)))


def sums(
    off_s: Array,
    cn0_db_hz: npt.ArrayLike,
    bits: npt.ArrayLike,
    phase_turns: float = 0.0,
    rng: np.random.Generator | None = None,
) -> npt.NDArray[np.complex128]:
    """(b, 9) sums of bits, noise of unit power (rng; without it none).

    off_s: (b + 1,) by how much the signal comes later than the replica, where bits begin and end. cn0_db_hz: one or
    (b,). bits: (b,) +-1. phase_turns: of the carrier besides.
    """
    middle_s, rate = 0.5 * (off_s[1:] + off_s[:-1]), np.diff(off_s) / BIT_S
    amplitude = np.sqrt(10.0 ** (np.asarray(cn0_db_hz) / 10.0) * BIT_S) * np.sinc(L1_HZ * rate * BIT_S)
    carrier = np.exp(2j * np.pi * (phase_turns - L1_HZ * middle_s % 1.0))
    found: npt.NDArray[np.complex128] = (amplitude * bits * carrier)[:, None] * peak(
        middle_s[:, None] * CHIP_RATE_HZ - TAPS
    )
    if rng is not None:
        noise = rng.normal(size=(*found.shape, 2)) @ (1.0, 1j) / np.sqrt(2.0)
        found = found + noise @ ROOT.T
    return found
