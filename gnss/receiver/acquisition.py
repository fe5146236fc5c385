"""Which satellites are in samples, at which Doppler and delay: a search with Fourier transforms over both."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gnss.errors import SamplesError

from .cancellation import without_satellite
from .codes import CHIP_RATE_HZ, CHIPS, PRNS, ca_code
from .samples import Samples

__all__ = ["Acquired", "Acquisition", "Search", "acquire", "correlation_powers", "noise_limit"]

Powers = npt.NDArray[np.float32]
Spectra = npt.NDArray[np.complex64]
LIKENESS = 10.0**-2.1  # of two codes at any delay and Doppler, in power
LONGEST_S = 0.1  # by then a Doppler of 5 kHz has moved the code by a third of a chip


@dataclass(frozen=True)
class Search:
    """Where to look: Dopplers from -doppler_max_hz in steps of doppler_step_hz, over duration_s from start_s on.

    coherent_ms: code periods summed with their phase; the powers of such sums are added up, so that a data bit that
    turns costs one of them. Steps should be at most half of 1/coherent. false_alarm: probability that noise alone lets
    one satellite be found, in the whole of its search. Raises SamplesError.
    """

    doppler_max_hz: float = 5000.0
    doppler_step_hz: float = 250.0
    coherent_ms: int = 1
    start_s: float = 0.0
    duration_s: float = 0.004
    false_alarm: float = 1e-3

    def __post_init__(self) -> None:
        if not (0.0 <= self.doppler_max_hz <= 1e5 and 1.0 <= self.doppler_step_hz <= 1e4):
            raise SamplesError("Dopplers reach from 0 to 100 kHz, in steps of 1 Hz to 10 kHz.")
        if not 0.0 < self.false_alarm < 1.0:
            raise SamplesError("A rate of false alarms lies between 0 and 1.")
        if not (1 <= self.coherent_ms <= 20 and self.start_s >= 0.0 and 1e-3 <= self.duration_s <= LONGEST_S):
            raise SamplesError(
                f"A search takes 1 to {1e3 * LONGEST_S:g} ms, 1 to 20 of them coherently, and no start before 0."
            )

    @property
    def dopplers_hz(self) -> npt.NDArray[np.float64]:
        """(d,) Dopplers that are tried, 0 in their middle."""
        count = int(self.doppler_max_hz / self.doppler_step_hz + 1e-9)
        return self.doppler_step_hz * np.arange(-count, count + 1, dtype=np.float64)


@dataclass(frozen=True)
class Acquired:
    """The highest cell of one satellite's search.

    code_start_sample: counted from 0, the first sample of the search at which a period of the code begins. power: over
    that of noise, 1 = noise. cn0_db_hz: what that power means, -inf below noise.
    """

    prn: int
    found: bool
    doppler_hz: float
    code_start_sample: int
    power: float
    cn0_db_hz: float


@dataclass(frozen=True)
class Acquisition:
    """What a search found: satellites in order of their power, and the power over noise from which on they count."""

    satellites: tuple[Acquired, ...]
    limit: float
    coherent_s: float
    sums: int

    @property
    def found(self) -> tuple[Acquired, ...]:
        """Those above the limit."""
        return tuple(one for one in self.satellites if one.found)


def noise_limit(false_alarm: float, cells: int, sums: int) -> float:
    """Mean of ``sums`` powers of noise, over their expectation, that one of ``cells`` exceeds with that probability.

    Each power is exponential, so that their sum is Erlang's. Neighbouring cells of a search share noise, which makes
    alarms rarer than that, never more frequent.
    """
    single = -math.expm1(math.log1p(-false_alarm) / cells)
    return _erlang_quantile(single, sums) / sums


def acquire(samples: Samples, search: Search | None = None, prns: Iterable[int] = PRNS) -> Acquisition:
    """Look for satellites by their C/A codes, all delays at once for each Doppler.

    The level of noise is the median over all cells of a satellite's search, so that a strong signal does not raise it.
    A satellite so strong that its code would be found as those of others is taken out of the samples before these are
    judged (``without_satellite``). Raises SamplesError where the samples are shorter than the search, GnssInputError
    for a PRN outside 1 to 32.
    """
    search, asked = search or Search(), tuple(dict.fromkeys(prns))
    codes = {prn: _code_spectrum(prn, samples.rate_hz) for prn in asked}
    if not codes:
        raise SamplesError("No satellite was named to look for.")
    part, first = _part(samples, search)
    strong: list[Acquired] = []
    while True:
        blocks = _blocks(part, search)
        sums = len(blocks) // search.coherent_ms
        limit = noise_limit(search.false_alarm, blocks.shape[1] * len(search.dopplers_hz), sums)
        told = _highest_cells(blocks, part, search, codes, limit)
        others = {prn: _code_spectrum(prn, samples.rate_hz) for prn in PRNS if prn not in asked}
        if not strong and any(one.found for one in told):  # in truth it may be one that nobody asked for
            told += _highest_cells(blocks, part, search, others, limit)
            codes.update(others)
        loudest = max((one.power for one in told), default=0.0)
        disturbing = [one for one in told if one.power > max(limit / 4.0 / LIKENESS, loudest / 10.0)]
        if not disturbing or len(disturbing) == len(codes):
            break
        for one in disturbing:
            part = without_satellite(part, one.prn, one.code_start_sample, one.doppler_hz, search.doppler_step_hz)
            del codes[one.prn]
        strong += disturbing
    satellites = [
        dataclasses.replace(one, code_start_sample=first + one.code_start_sample)
        for one in sorted(strong + told, key=lambda one: -one.power)
        if one.prn in asked
    ]
    return Acquisition(tuple(satellites), limit, search.coherent_ms * 1e-3, sums)


def correlation_powers(samples: Samples, prn: int, search: Search | None = None) -> Powers:
    """(Dopplers, samples of a period) mean power of a satellite's correlations over their median: the map of a search.

    Column n is a code that begins n samples after the search's start. Raises as ``acquire``.
    """
    search = search or Search()
    part, _ = _part(samples, search)
    blocks, code = _blocks(part, search), _code_spectrum(prn, samples.rate_hz)
    rows = [_powers(_spectra(blocks, part, search, float(doppler)), code) for doppler in search.dopplers_hz]
    powers: Powers = np.stack(rows)
    return powers / np.float32(np.median(powers))


def _highest_cells(
    blocks: Spectra, part: Samples, search: Search, codes: Mapping[int, Spectra], limit: float
) -> list[Acquired]:
    """The highest cell of each satellite, delays counted from the first sample of the blocks."""
    sums = len(blocks) // search.coherent_ms
    middle = _erlang_quantile(0.5, sums) / sums
    best = dict.fromkeys(codes, (-1.0, 0.0, 0))
    levels: dict[int, list[float]] = {prn: [] for prn in codes}
    for doppler_hz in search.dopplers_hz:
        spectra = _spectra(blocks, part, search, float(doppler_hz))
        for prn, code in codes.items():
            powers = _powers(spectra, code)
            top = int(powers.argmax())
            levels[prn].append(float(np.median(powers)))
            if powers[top] > best[prn][0]:
                best[prn] = float(powers[top]), float(doppler_hz), top
    found = []
    for prn, (power, doppler_hz, delay) in best.items():
        over = power * middle / float(np.median(levels[prn]))
        density = (over - 1.0) * 1e3 / search.coherent_ms
        cn0_db_hz = 10.0 * math.log10(density) if density > 0.0 else -math.inf
        found.append(Acquired(prn, over > limit, doppler_hz, delay, over, cn0_db_hz))
    return found


def _part(samples: Samples, search: Search) -> tuple[Samples, int]:
    """(samples of the search, number of the first)."""
    first = round(search.start_s * samples.rate_hz)
    count = math.ceil(round(search.duration_s * 1e3) * 1e-3 * samples.rate_hz)
    if first + count > len(samples.values):
        raise SamplesError(
            f"There are {1e3 * samples.duration_s:.4g} ms in {samples.source or 'the samples'}; a search of "
            f"{1e3 * search.duration_s:g} ms from {1e3 * search.start_s:g} ms on needs more."
        )
    return dataclasses.replace(samples, values=samples.values[first : first + count]), first


def _blocks(part: Samples, search: Search) -> Spectra:
    """(periods, samples of a period) the samples by code period, a whole number of coherent sums."""
    period = part.rate_hz / CHIP_RATE_HZ * CHIPS
    asked = round(search.duration_s * 1e3) // search.coherent_ms * search.coherent_ms
    if asked == 0:
        raise SamplesError(f"{search.coherent_ms} ms cannot be summed within {1e3 * search.duration_s:g} ms.")
    starts = np.minimum(np.round(period * np.arange(asked)).astype(np.int64), len(part.values) - round(period))
    return part.values[starts[:, None] + np.arange(round(period))]


def _spectra(blocks: Spectra, samples: Samples, search: Search, doppler_hz: float) -> Spectra:
    """(sums, samples of a period): spectra of the blocks without a Doppler, those of each coherent sum added up."""
    count, size = blocks.shape
    turns = (samples.intermediate_hz + doppler_hz) / samples.rate_hz
    period = samples.rate_hz / CHIP_RATE_HZ * CHIPS
    starts = np.round(period * np.arange(count))
    # the phase at the beginning of each block in double precision: over many periods it takes thousands of turns
    ahead = np.exp(-2j * np.pi * (turns * starts % 1.0)).astype(np.complex64)
    within = np.exp(-2j * np.pi * turns * np.arange(size)).astype(np.complex64)
    summed = (blocks * ahead[:, None]).reshape(-1, search.coherent_ms, size).sum(axis=1) * within
    return np.fft.fft(summed, axis=1).astype(np.complex64, copy=False)


def _code_spectrum(prn: int, rate_hz: float) -> Spectra:
    """Conjugate spectrum of a period of a code at a sampling rate."""
    size = round(rate_hz / CHIP_RATE_HZ * CHIPS)
    chips = ca_code(prn)[np.arange(size) * CHIPS // size]
    return np.conj(np.fft.fft(chips)).astype(np.complex64)


def _powers(spectra: Spectra, code: Spectra) -> Powers:
    """(samples of a period,) mean power of the correlations at each delay."""
    found = np.fft.ifft(spectra * code, axis=1)
    powers: Powers = np.mean(found.real**2 + found.imag**2, axis=0)
    return powers


def _erlang_quantile(tail: float, sums: int) -> float:
    """x that a sum of unit exponentials exceeds with that probability."""
    low, high = 0.0, 10.0 * sums + 100.0 - 2.0 * math.log(tail)
    while high - low > 1e-9 * high:
        x = 0.5 * (low + high)
        term, total = 1.0, 1.0
        for k in range(1, sums):
            term *= x / k
            total += term
        low, high = (x, high) if total * math.exp(-x) > tail else (low, x)
    return 0.5 * (low + high)
