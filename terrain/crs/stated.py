"""The texts in which a raster states its CRS, looked at before GDAL is: it opens the grid files that they name."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import BinaryIO

from ..errors import DemFormatError, DemUnsupportedError, FrameError
from .texts import check_no_files

__all__ = ["check_stated_crs", "check_stated_stream", "prj_text"]

PRJ_BYTES = 1 << 20
GEO_ASCII_PARAMS = 34737
MOST_ENTRIES = 65_536


def check_stated_crs(file: Path, driver: str) -> None:
    """Raises DemUnsupportedError where the CRS of a raster names a file, DemFormatError for a damaged TIFF."""
    if driver == "GTiff":
        with file.open("rb") as stream:
            check_stated_stream(file.name, stream)
        return
    text = prj_text(file) if driver == "AAIGrid" else None
    if text is not None:
        _check(file.name, f"{file.stem}.prj beside it", text)


def check_stated_stream(name: str, stream: BinaryIO) -> None:
    """The same of a TIFF that is open. Raises DemUnsupportedError, DemFormatError."""
    try:
        texts = _geo_texts(stream)
    except struct.error as error:
        raise DemFormatError(f"{name} is damaged or cut short: GDAL cannot read it as GTiff.") from error
    for text in texts:
        _check(name, "its CRS", text)


def _check(name: str, where: str, text: str) -> None:
    try:
        check_no_files(text)
    except FrameError as error:
        raise DemUnsupportedError(f"{name} is not read because of {where}. {error}") from error


def prj_text(file: Path) -> str | None:
    """What stands in the .prj beside a file, where GDAL looks for it; None without one. Raises DemFormatError."""
    for beside in (file.with_suffix(".prj"), file.with_suffix(".PRJ")):
        if beside.is_file():
            with beside.open("rb") as stream:
                content = stream.read(PRJ_BYTES + 1)
            if len(content) > PRJ_BYTES:
                raise DemFormatError(f"{beside.name} is too long for the description of a CRS.")
            return content.decode("latin-1")
    return None


def _go_to(stream: BinaryIO, place: int) -> None:
    """Go to a place that a damaged file may put beyond its end, or beyond any file."""
    if place > stream.seek(0, io.SEEK_END):
        raise struct.error
    stream.seek(place)


def _geo_texts(stream: BinaryIO) -> list[str]:
    """The texts of the GeoTIFF keys of the first image. Raises struct.error where it is damaged."""
    order = "<" if stream.read(2) == b"II" else ">"
    big = _number(stream, order + "H") == 43
    if big:
        stream.seek(8)
    first = _number(stream, order + ("Q" if big else "I"))
    _go_to(stream, first)
    entries = _number(stream, order + ("Q" if big else "H"))
    entry = struct.Struct(order + ("HHQ8s" if big else "HHI4s"))
    texts = []
    for _ in range(min(entries, MOST_ENTRIES)):
        tag, _, count, value = entry.unpack(stream.read(entry.size))
        if tag != GEO_ASCII_PARAMS:
            continue
        if count <= len(value):
            texts.append(value[:count].decode("latin-1"))
            continue
        after = stream.tell()
        _go_to(stream, struct.unpack(order + ("Q" if big else "I"), value)[0])
        texts.append(stream.read(min(count, PRJ_BYTES)).decode("latin-1"))
        stream.seek(after)
    return texts


def _number(stream: BinaryIO, layout: str) -> int:
    return int(struct.unpack(layout, stream.read(struct.calcsize(layout)))[0])
