"""Recorded samples of a front end, judged before a satellite is looked for in them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from gnss.errors import SamplesError

from .codes import CHIP_RATE_HZ

__all__ = ["SAMPLE_TYPES", "SampleType", "Samples", "read_samples", "recorded_s"]

Values = npt.NDArray[np.complex64]
SampleType = Literal["complex64", "int16", "int8"]
# in-phase and quadrature one after the other, little-endian, of each type
SAMPLE_TYPES: dict[str, str] = {"complex64": "<f4", "int16": "<i2", "int8": "i1"}
LEAST_RATE_HZ, MOST_RATE_HZ = 2.0 * 0.99 * CHIP_RATE_HZ, 100e6
# numbers of another type read as float32 are spread over dozens of orders of magnitude, noise over a few
WIDEST_SPREAD = 1e4
UNLIKE = 3.0
CLIPPED_SHARE, TOLD_SHARE = 0.5, 0.01
FEW_VALUES, JUDGED = 32, 100_000  # so few values are a front end's bits, whose outermost are common


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples (n,) complex64 of a rate; intermediate_hz: where L1 lies in them, 0 = baseband. warnings: sentences.

    The signal of a satellite is taken as amplitude · data · code(t - delay) · exp(+i(2π(intermediate + Doppler)t +
    phase)), sample 0 at t = 0: a satellite that comes nearer has a positive Doppler, unless the front end mirrors the
    spectrum. Raises SamplesError where they cannot be used.
    """

    values: Values
    rate_hz: float
    intermediate_hz: float = 0.0
    source: str = ""
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        name = self.source or "the samples"
        if not LEAST_RATE_HZ <= self.rate_hz <= MOST_RATE_HZ:
            raise SamplesError(
                f"A C/A signal needs {LEAST_RATE_HZ / 1e6:.2f} to {MOST_RATE_HZ / 1e6:g} million complex samples a "
                f"second, not {self.rate_hz / 1e6:g}; the rate is that of pairs, in Hz."
            )
        if not abs(self.intermediate_hz) <= self.rate_hz / 2.0:
            raise SamplesError("The intermediate frequency must lie within half of the sampling rate.")
        values = np.ascontiguousarray(self.values, np.complex64)
        if values.ndim != 1 or len(values) < self.rate_hz * 1e-3:
            raise SamplesError(
                f"There are {1e3 * values.size / self.rate_hz:.3g} ms in {name}, and one code period of 1 ms is needed."
            )
        parts = values.view(np.float32)
        if not np.isfinite(parts).all():
            raise SamplesError(f"There are numbers in {name} that are not finite; are the samples of another type?")
        largest, middle = float(np.abs(parts).max()), float(np.sqrt(np.mean(np.square(parts, dtype=np.float64))))
        if not middle > 0.0:
            raise SamplesError(f"All numbers in {name} are zero.")
        typical = float(np.median(np.abs(parts)))
        if typical > 0.0 and largest / typical > WIDEST_SPREAD:
            raise SamplesError(
                f"Numbers in {name} reach {largest / typical:.2g} times their median, which no receiver's noise does; "
                "are the samples of another type?"
            )
        view = values.view()
        view.setflags(write=False)
        object.__setattr__(self, "values", view)

    @property
    def duration_s(self) -> float:
        """How long they last."""
        return len(self.values) / self.rate_hz


def read_samples(
    path: Path | str,
    rate_hz: float,
    sample_type: SampleType = "complex64",
    *,
    intermediate_hz: float = 0.0,
    start_s: float = 0.0,
    duration_s: float = math.inf,
) -> Samples:
    """Samples of a file, in-phase and quadrature of each in turn, little-endian; more than asked for is not read.

    Warnings tell an end in the middle of a sample, and clipping. Raises SamplesError where the file is missing or too
    short, of another type, or clipped so that most numbers lie at a limit: of int8 or int16, or their own.
    """
    place = Path(path)
    if sample_type not in SAMPLE_TYPES:
        raise SamplesError(f"Samples are of {', '.join(SAMPLE_TYPES)}, not {sample_type!r}.")
    if not (start_s >= 0.0 and duration_s > 0.0 and rate_hz > 0.0 and math.isfinite(rate_hz)):
        raise SamplesError("The start must be zero or more, the duration and the rate above zero.")
    kind = np.dtype(SAMPLE_TYPES[sample_type])
    try:
        size = place.stat().st_size
        first = 2 * round(start_s * rate_hz) * kind.itemsize
        most = -1 if math.isinf(duration_s) else 2 * round(duration_s * rate_hz)
        with place.open("rb") as file:
            file.seek(min(first, size))
            read = np.fromfile(file, kind, most)
    except OSError as error:
        raise SamplesError(f"{place} cannot be read: {error.strerror or error}.") from error
    warnings = []
    if size % (2 * kind.itemsize):
        warnings.append(f"{place.name} ends in the middle of a sample; its last bytes are left out.")
        read = read[: len(read) // 2 * 2]
    if math.isfinite(duration_s) and len(read) < most:
        raise SamplesError(
            f"{place.name} is truncated: from {start_s:g} s on it holds {1e3 * len(read) / 2.0 / rate_hz:.3g} ms, "
            f"{1e3 * duration_s:g} ms were asked for."
        )
    clipped = _clipped_share(read)
    if clipped > CLIPPED_SHARE:
        raise SamplesError(f"{place.name} is clipped: {100.0 * clipped:.0f} % of its numbers lie at a limit.")
    if clipped > TOLD_SHARE:
        warnings.append(f"{100.0 * clipped:.1f} % of the numbers of {place.name} are clipped; signals are weaker.")
    if kind.kind == "i":
        _check_alike(place.name, read)
    values = read.astype(np.float32).view(np.complex64)
    return Samples(values, rate_hz, intermediate_hz, place.name, tuple(warnings))


def recorded_s(path: Path | str, rate_hz: float, sample_type: SampleType = "complex64", start_s: float = 0.0) -> float:
    """How long a file's samples last from a start within it on, by its size. Raises SamplesError."""
    place = Path(path)
    try:
        size = place.stat().st_size
    except OSError as error:
        raise SamplesError(f"{place} cannot be read: {error.strerror or error}.") from error
    if not (rate_hz > 0.0 and math.isfinite(rate_hz)):
        raise SamplesError("The start must be zero or more, the duration and the rate above zero.")
    whole_s = float(size // (2 * np.dtype(SAMPLE_TYPES[sample_type]).itemsize) / rate_hz)
    if not 0.0 <= start_s < whole_s:
        raise SamplesError(f"{place.name} lasts {whole_s:g} s; there is nothing from {start_s:g} s on.")
    return whole_s - start_s


def _clipped_share(read: npt.NDArray[Any]) -> float:
    """Of numbers at the limits of their type, or at their own outermost where a converter has fewer bits than that."""
    if not len(read):
        return 0.0
    if read.dtype.kind == "i":
        limits = np.iinfo(read.dtype)
        share = float(np.mean((read == limits.max) | (read == limits.min)))
        if share > TOLD_SHARE:
            return share
    if len(np.unique(read[:JUDGED])) <= FEW_VALUES:
        return 0.0
    return float(np.mean((read == read.max()) | (read == read.min())))


def _check_alike(name: str, read: npt.NDArray[np.generic]) -> None:
    """Raise SamplesError where bytes of wider numbers are taken for samples: every other one is of another kind."""
    whole = np.abs(read[: len(read) // 4 * 4].reshape(-1, 4).astype(np.float64))
    spreads = whole.std(axis=0) if len(whole) else np.zeros(4)
    if spreads.max() > UNLIKE * spreads.min():
        raise SamplesError(
            f"In {name} in-phase and quadrature, or every other sample, are spread quite differently; are the samples "
            "of another type?"
        )
