"""The header of an ESRI ASCII grid: each word that GDAL takes is a number, and each axis states its own place."""

from __future__ import annotations

import re
from pathlib import Path
from typing import BinaryIO

from ..crs.stated import prj_text
from ..errors import DemFormatError

__all__ = ["NUMBER", "ascii_place", "check_ascii_header", "read_header", "unit_in_prj"]

# GDAL looks for the header no further than this, and has the values begin where a line begins with no letter, or "nan"
HEADER_BYTES = 1 << 16
VALUES_BEGIN = re.compile(rb"[\r\n](?=nan|[^A-Za-z\r\n])", re.IGNORECASE)
# what GDAL reads as it is meant; of -nan and NAN it makes 0
NUMBER = re.compile(
    rb"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?|\+?(nan|NaN)|[-+]?(inf|Inf|INF)|-?1\.#(QNAN|INF)|-1\.#IND"
)
X_PLACES, Y_PLACES = ("xllcorner", "xllcenter"), ("yllcorner", "yllcenter")
KEYWORDS = {"ncols", "nrows", "cellsize", "dx", "dy", "nodata_value", *X_PLACES, *Y_PLACES}
LONGEST_SHOWN = 40
ZUNITS_PER_METRE = {"1": "m", "10": "dm", "100": "cm", "1000": "mm"}
ZUNITS = re.compile(r"^[ \t]*zunits[ \t]+(\S+)", re.IGNORECASE | re.MULTILINE)


def read_header(stream: BinaryIO) -> bytes:
    """The header; the stream goes on where the values begin."""
    start = stream.read(HEADER_BYTES)
    begin = VALUES_BEGIN.search(start)
    if begin is None:
        return start
    stream.seek(begin.end())
    return start[: begin.start()]


def check_ascii_header(file: Path) -> None:
    """Raises DemFormatError for a word that is no number, a line that stands there twice, an axis without a place."""
    told = _told(file)
    for places in (X_PLACES, Y_PLACES):
        if not any(place in told for place in places):
            raise DemFormatError(f"{file.name} does not say where it lies: its header has no {' or '.join(places)}.")


def ascii_place(file: Path, rows: int, step: tuple[float, float]) -> tuple[float, float] | None:
    """(x, y) of post (0, 0) where one axis states a corner and the other a centre, which GDAL puts at zero; else None.

    step: between posts, east and south, in the units of the file's CRS as x and y are.
    """
    told = _told(file)
    x_place, y_place = (next(place for place in places if place in told) for places in (X_PLACES, Y_PLACES))
    if x_place[3:] == y_place[3:]:
        return None
    x = told[x_place] + (0.5 * step[0] if x_place.endswith("corner") else 0.0)
    y = told[y_place] + (0.5 * step[1] if y_place.endswith("corner") else 0.0)
    return x, y + (rows - 1) * step[1]


def unit_in_prj(file: Path) -> str | None:
    """What an Arc/Info .prj beside an ESRI ASCII grid says of its heights, which GDAL leaves out."""
    found = ZUNITS.search(prj_text(file) or "")
    return None if found is None or found[1].upper() == "NO" else ZUNITS_PER_METRE.get(found[1], found[1])


def _told(file: Path) -> dict[str, float]:
    """The numbers of the header by their keywords, in lower case."""
    with file.open("rb") as stream:
        words = read_header(stream).split()
    told = dict[str, float]()
    for keyword, value in zip(words, [*words[1:], b""], strict=True):
        name = keyword.decode("latin-1").lower()
        if name not in KEYWORDS:
            continue
        if NUMBER.fullmatch(value) is None:
            shown = value[:LONGEST_SHOWN].decode("latin-1")
            raise DemFormatError(f"{file.name} is damaged: {shown!r} after {name} in its header is not a number.")
        for earlier in told:
            if earlier.replace("center", "corner") == name.replace("center", "corner"):
                raise DemFormatError(f"{file.name} is damaged: its header states {name} after {earlier}.")
        told[name] = _number(value)
    return told


def _number(word: bytes) -> float:
    return float("nan") if b"#" in word else float(word.replace(b",", b"."))
