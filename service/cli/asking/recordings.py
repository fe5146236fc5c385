"""Recorded samples as arguments and options: the file, what it does not say of itself, and satellites by number."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from service.errors import RequestError
from service.files.written import whole_number

from .options import GROUP, option

if TYPE_CHECKING:
    from gnss.receiver import Samples

__all__ = ["SampleFile", "SampleOptions", "satellite_numbers"]

SampleFile = Annotated[
    Path, Parameter(name="FILE", allow_leading_hyphen=False, help="In-phase and quadrature of each sample in turn.")
]


@GROUP
@dataclass(frozen=True, slots=True)
class SampleOptions:
    """What the file does not say of itself."""

    rate_hz: Annotated[float, option("Complex samples a second, such as 4e6.", "HZ", "--rate")]
    type: Annotated[
        Literal["complex64", "int16", "int8"], option("Of the numbers, little-endian.", "complex64|int16|int8")
    ] = "complex64"
    intermediate_hz: Annotated[float, option("Where L1 lies in the samples.", "HZ", "--intermediate")] = 0.0
    start_s: Annotated[float, option("Where to begin.", "S", "--start")] = 0.0

    def read(self, path: Path, duration_s: float = math.inf, after_s: float = 0.0) -> Samples:
        """The samples from the start, or so long after it, on. Raises SamplesError."""
        from gnss.receiver import read_samples

        return read_samples(
            path,
            self.rate_hz,
            self.type,
            intermediate_hz=self.intermediate_hz,
            start_s=self.start_s + after_s,
            duration_s=duration_s,
        )


def satellite_numbers(text: str) -> Sequence[int]:
    """Of --prn. Raises RequestError."""
    try:
        return list(dict.fromkeys(whole_number(word) for word in text.split(",")))
    except ValueError as fault:
        raise RequestError(f"--prn takes numbers of satellites such as 1,7,12, not {text!r}.") from fault
