"""The texts in which a raster states its CRS, looked at before GDAL is: it opens the grid files that they name."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import BinaryIO

from .crs_texts import check_no_files
from .errors import DemFormatError, DemUnsupportedError, FrameError

__all__ = ["check_stated_crs", "prj_text"]

PRJ_BYTES = 1 << 20
GEO_ASCII_PARAMS = 34737
MOST_ENTRIES = 65_536


def check_stated_crs(file: Path, driver: str) -> None:
    """Raises DemUnsupportedError where the CRS of a raster names a file, DemFormatError for a damaged TIFF."""
    if driver == "GTiff":
        texts = [("its CRS", text) for text in _geotiff_texts(file)]
    else:
        text = prj_text(file) if driver == "AAIGrid" else None
        texts = [] if text is None else [(f"{file.stem}.prj beside it", text)]
    for where, text in texts:
        try:
            check_no_files(text)
        except FrameError as error:
            raise DemUnsupportedError(f"{file.name} is not read because of {where}. {error}") from error


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


def _geotiff_texts(file: Path) -> list[str]:
    """The texts of the GeoTIFF keys of the first image."""
    try:
        with file.open("rb") as stream:
            return _geo_texts(stream)
    except struct.error as error:
        raise DemFormatError(f"{file.name} is damaged or cut short: GDAL cannot read it as GTiff.") from error


def _go_to(stream: BinaryIO, place: int) -> None:
    """Go to a place that a damaged file may put beyond its end, or beyond any file."""
    if place > stream.seek(0, io.SEEK_END):
        raise struct.error
    stream.seek(place)


def _geo_texts(stream: BinaryIO) -> list[str]:
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
