"""A second of signal summed though its data bits are unknown: the bits that give the most energy, found exactly."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
import numpy.typing as npt

from gnss.errors import GnssInputError

__all__ = ["BIT_S", "BitSearch", "bits_needed", "energy_limit", "search_bits"]

Array = npt.NDArray[np.float64]
BIT_S = 0.02
DIVISORS = (1, 2, 5, 10, 25, 50)
# of |Re n|, n complex noise of unit power: mean, variance, skewness, excess kurtosis of the half-normal distribution
MEAN, VARIANCE = 1.0 / math.sqrt(math.pi), 0.5 - 1.0 / math.pi
SKEWNESS = math.sqrt(2.0) * (4.0 - math.pi) / (math.pi - 2.0) ** 1.5
KURTOSIS = 8.0 * (math.pi - 3.0) / (math.pi - 2.0) ** 2


@dataclass(frozen=True, eq=False)
class BitSearch:
    """What m searches over n bits found.

    bits: (m, n) +-1, right up to the sign of all. total: (m,) complex sums without the bits; its phase is right up to
    half a cycle. amplitude: (m,) its magnitude, which ``energy_limit`` judges where noise has unit power.
    """

    bits: npt.NDArray[np.int8]
    total: npt.NDArray[np.complex128]

    @property
    def amplitude(self) -> Array:
        """(m,) magnitudes of the sums."""
        return np.abs(self.total)


def search_bits(sums: npt.ArrayLike) -> BitSearch:
    """The signs of (m, n) or (n,) complex sums of one bit each that make the magnitude of their total greatest.

    Exact among all 2^n, with n candidates: for the best phase each bit is the sign of its sum's part along that phase,
    and while the phase turns by half a circle each bit turns once. The sums are folded to a half plane, sorted by
    phase, and turned one at a time (the principle of Mackenthun, IEEE Trans. Commun. 42(2-4), 1994, O(n log n)).
    Raises GnssInputError.
    """
    values = np.atleast_2d(np.asarray(sums, np.complex128))
    if values.ndim != 2 or values.shape[1] == 0 or not np.isfinite(values).all():
        raise GnssInputError("Sums of bits must be finite and (searches, bits), one bit at least.")
    upper = (values.imag > 0.0) | ((values.imag == 0.0) & (values.real > 0.0))
    signs = np.where(upper, 1, -1).astype(np.int8)
    folded = values * signs
    order = np.argsort(np.angle(folded), axis=1)
    turned = np.take_along_axis(folded, order, axis=1)
    # candidate j: the j sums of least phase turned over
    totals = folded.sum(axis=1, keepdims=True) - 2.0 * (np.cumsum(turned, axis=1) - turned)
    best = np.argmax(totals.real**2 + totals.imag**2, axis=1)
    ranks = np.empty_like(order)
    np.put_along_axis(ranks, order, np.broadcast_to(np.arange(order.shape[1]), order.shape), axis=1)
    bits = np.where(ranks < best[:, None], -signs, signs).astype(np.int8)
    return BitSearch(bits, np.take_along_axis(totals, best[:, None], axis=1)[:, 0])


@functools.lru_cache(maxsize=256)
def energy_limit(false_alarm: float, bits: int, cells: int = 1) -> float:
    """Magnitude of a total that noise of unit power per bit exceeds with that probability, in one of so many cells.

    At one phase the total is a sum of half-normal numbers (Cornish and Fisher's expansion); over all phases Rice's
    formula counts how often it crosses a level. Raises GnssInputError.
    """
    if not (0.0 < false_alarm < 1.0 and bits >= 1 and cells >= 1):
        raise GnssInputError("A limit needs a rate of false alarms between 0 and 1, and one bit and cell at least.")
    single = -math.expm1(math.log1p(-false_alarm) / cells)
    crossings = 0.5 * math.sqrt(0.5 / VARIANCE)
    low, high = 0.0, 40.0
    for _ in range(100):
        u = 0.5 * (low + high)
        chance = NormalDist().cdf(-u) + crossings * math.exp(-0.5 * u * u)
        low, high = (u, high) if chance > single else (low, u)
    skewness, kurtosis = SKEWNESS / math.sqrt(bits), KURTOSIS / bits
    bent = u + skewness * (u * u - 1.0) / 6.0 + kurtosis * (u**3 - 3.0 * u) / 24.0
    bent -= skewness**2 * (2.0 * u**3 - 5.0 * u) / 36.0
    return float(bits * MEAN + bent * math.sqrt(bits * VARIANCE))


def bits_needed(cn0_db_hz: float, detection: float = 0.99, false_alarm: float = 1e-3, cells: int = 1) -> int:
    """How many bits, a whole share of the 50 of a second, must be summed to find a signal so strong; 50 if none do.

    Each bit adds the part of its sum along the signal's phase, without its sign: a folded normal number. Raises
    GnssInputError.
    """
    if not (0.0 < detection < 1.0) or math.isnan(cn0_db_hz):
        raise GnssInputError("A probability of detection lies between 0 and 1, and C/N0 is a number.")
    a = math.sqrt(10.0 ** (cn0_db_hz / 10.0) * BIT_S)
    mean = MEAN * math.exp(-a * a) + a * math.erf(a)
    spread = math.sqrt(0.5 + a * a - mean * mean)
    below = NormalDist().inv_cdf(detection) * spread
    for count in DIVISORS:
        if count * mean - math.sqrt(count) * below > energy_limit(false_alarm, count, cells):
            return count
    return DIVISORS[-1]
