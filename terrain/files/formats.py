"""Which files may be read: told by their content, never by asking GDAL's full list of drivers."""

from __future__ import annotations

import os
import re
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

from ..errors import DemFormatError, DemReadError, GroundChangedError

__all__ = ["FORMATS", "local_file", "sniff_format", "unchanged"]

FORMATS = ("GTiff", "AAIGrid", "SRTMHGT", "DTED", "NPZ", "NPY")
READABLE = "GeoTIFF, ESRI ASCII grid, SRTM .hgt, DTED, .npz and .npy can be read"

TIFF_MAGIC = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
PACKED_MAGIC = {b"\x1f\x8b": "gzip", b"BZh": "bzip2", b"\xfd7zXZ": "xz", b"7z\xbc\xaf": "7-Zip", b"(\xb5/\xfd": "zstd"}
HGT_NAME = re.compile(r"[NS]\d{2}[EW]\d{3}", re.IGNORECASE)
# posts per side: 1, 3 and 30 arc seconds, and the half and third second tiles; plus 3601 × 1801 north of 50°
HGT_POSTS = {side * side for side in (121, 1201, 3601, 7201, 10801)} | {3601 * 1801}
ASCII_KEYWORDS = (
    "ncols",
    "nrows",
    "xllcorner",
    "xllcenter",
    "yllcorner",
    "yllcenter",
    "cellsize",
    "nodata_value",
)


class KnownFile(Protocol):
    """A file whose header was read: where it is, and its size and time at that moment."""

    @property
    def path(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def size_bytes(self) -> int: ...
    @property
    def modified_ns(self) -> int: ...


def _check_unchanged(file: KnownFile, *, since: str, then: str) -> None:
    """Raises GroundChangedError where the file is gone, or has another size or time than when its header was read.

    since, then: when it was read and what to do, for the sentence.
    """
    try:
        found = Path(file.path).stat()
    except OSError as error:
        raise GroundChangedError(f"{file.name} is not there any more; {then}.") from error
    if (found.st_size, found.st_mtime_ns) != (file.size_bytes, file.modified_ns):
        raise GroundChangedError(f"{file.name} was changed since {since}; {then}.")


@contextmanager
def unchanged(file: KnownFile, *, since: str, then: str) -> Iterator[None]:
    """Read a known file within: GroundChangedError where it was another before, meanwhile or after.

    What cannot be read because somebody writes it at that moment is told as a change, too.
    """
    _check_unchanged(file, since=since, then=then)
    try:
        yield
    except DemReadError:
        _check_unchanged(file, since=since, then=then)
        raise
    except OSError as error:
        _check_unchanged(file, since=since, then=then)
        raise DemReadError(f"{file.name} cannot be read: {error.strerror or error}.") from error
    _check_unchanged(file, since=since, then=then)


def local_file(path: str | os.PathLike[str]) -> Path:
    """The path of an ordinary file on this machine.

    Raises DemFormatError for URLs and GDAL's virtual paths, DemReadError when no such file can be read.
    """
    text = os.fspath(path)
    if not isinstance(text, str):
        raise DemReadError("The path of a DEM must be text, not bytes.")
    if "://" in text or text.lower().startswith("/vsi") or "\0" in text:
        raise DemFormatError(f"{text[:80]!r} is not a file on this machine; download the DEM and give its path.")
    if not text:
        raise DemReadError("The path of the DEM is empty; give the path of a file.")
    try:
        file = Path(text).expanduser()
        is_folder, is_file = file.is_dir(), file.is_file()
        file.name.encode()  # GDAL takes names as UTF-8 only
    except (OSError, RuntimeError, UnicodeEncodeError) as error:
        raise DemReadError(f"{text[:80]!r} cannot be the name of a DEM file: {_reason(error)}.") from error
    if is_folder:
        raise DemReadError(f"{file.name or text} is a folder; give the DEM file in it.")
    if not is_file:
        raise DemReadError(f"There is no DEM file {text[:200]!r}.")
    # absolute, so that no file name can be read as a GDAL prefix such as GTIFF_DIR:
    return file.resolve()


def _reason(error: Exception) -> str:
    if isinstance(error, UnicodeEncodeError):
        return "it is not UTF-8"
    return str(getattr(error, "strerror", None) or error).rstrip(".").lower()


def sniff_format(file: Path) -> str:
    """One of FORMATS, told by the first bytes (an .hgt by its name and length). Raises DemFormatError for others."""
    name = file.name
    try:
        with file.open("rb") as stream:
            head = stream.read(512)
    except OSError as error:
        raise DemReadError(f"{name} cannot be opened: {error.strerror}.") from error
    if not head:
        raise DemFormatError(f"{name} is empty.")
    if head.startswith(TIFF_MAGIC):
        return "GTiff"
    if head.startswith(b"\x93NUMPY"):
        return "NPY"
    if head.startswith(b"PK"):
        return _sniff_zip(file)
    packing = next((label for magic, label in PACKED_MAGIC.items() if head.startswith(magic)), None)
    if packing is not None:
        raise DemFormatError(f"{name} is {packing} data; unpack it first ({READABLE}).")
    if head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        raise DemFormatError(f"{name} holds XML (a VRT or a web page), which may point at other files; {READABLE}.")
    if any(head[at : at + 4] == b"UHL1" for at in (0, 80, 160)):
        return "DTED"
    if file.suffix.lower() == ".hgt":
        return _checked_hgt(file)
    words = head.decode("latin-1").lower().split()
    if words and words[0] in ASCII_KEYWORDS:
        return "AAIGrid"
    raise DemFormatError(f"{name} is not a DEM in a known format; {READABLE}.")


def _sniff_zip(file: Path) -> str:
    try:
        with zipfile.ZipFile(file) as archive:
            members = archive.namelist()
    except (zipfile.BadZipFile, OSError, NotImplementedError) as error:
        raise DemFormatError(f"{file.name} is a damaged zip or .npz file.") from error
    if "heights_m.npy" in members:
        return "NPZ"
    raise DemFormatError(f"{file.name} is a zip archive without heights_m.npy; unpack it first ({READABLE}).")


def _checked_hgt(file: Path) -> str:
    if HGT_NAME.match(file.name) is None:
        raise DemFormatError(f"{file.name}: an .hgt file tells its place by its name alone, such as N44W072.hgt.")
    length = file.stat().st_size
    if length % 2 or length // 2 not in HGT_POSTS:
        raise DemFormatError(f"{file.name} is {length:,} bytes long, which is no SRTM tile (1201² or 3601² posts).")
    return "SRTMHGT"
