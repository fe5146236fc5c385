"""Whether an ESRI ASCII grid holds what it announces: GDAL reads words, and what is missing at the end, as 0."""

from __future__ import annotations

import contextlib
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import DemFormatError
from .ascii_header import NUMBER, read_header

__all__ = ["check_ascii_values", "whole_numbers"]

# larger ones are slower: their words no longer fit the cache
CHUNK_BYTES = 1 << 16
LONGEST_WORD, LONGEST_SHOWN = 1000, 40
USUAL = b"0123456789+-.eE \t\r\n\v\f"


def check_ascii_values(file: Path, rows: int, cols: int) -> None:
    """Raises DemFormatError where the values after the header are not rows × cols numbers; memory stays bounded."""
    count, rest = 0, b""
    with file.open("rb") as stream:
        read_header(stream)
        while chunk := stream.read(CHUNK_BYTES):
            chunk = rest + chunk
            words = chunk.split()
            # the last word may go on in the next chunk
            rest = words.pop() if words and not chunk[-1:].isspace() else b""
            _check_numbers(file.name, words, count, cols, usual=not chunk.translate(None, USUAL))
            count += len(words)
            if len(rest) > LONGEST_WORD:
                raise _no_number(file.name, rest, count, cols)
    if rest:
        _check_numbers(file.name, [rest], count, cols, usual=False)
        count += 1
    if count != rows * cols:
        raise DemFormatError(
            f"{file.name} is damaged or cut short: {count:,} values where {cols:,} × {rows:,} = {rows * cols:,} are "
            "announced."
        )


def whole_numbers(values: npt.NDArray[np.float64]) -> npt.NDArray[Any]:
    """The values as 32 bit integers where that is what they all are."""
    limits = np.iinfo(np.int32)
    if np.isfinite(values).all() and limits.min <= values.min() and values.max() <= limits.max:
        return values.astype(np.int32)
    return values


def _check_numbers(name: str, words: list[bytes], before: int, cols: int, *, usual: bool) -> None:
    """words: the values after the first ``before``; usual: of USUAL alone, of which Python reads what GDAL does."""
    if usual:
        with contextlib.suppress(ValueError):  # which word it is, the loop below finds out
            deque(map(float, words), maxlen=0)
            return
    for at, word in enumerate(words, before):
        if NUMBER.fullmatch(word) is None:
            raise _no_number(name, word, at, cols)


def _no_number(name: str, word: bytes, at: int, cols: int) -> DemFormatError:
    shown = word[:LONGEST_SHOWN].decode("latin-1") + ("…" if len(word) > LONGEST_SHOWN else "")
    return DemFormatError(f"{name} is damaged: {shown!r} in row {at // cols + 1:,} is not a number.")
