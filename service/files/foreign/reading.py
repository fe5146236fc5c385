"""One door for the files of other programs: which reader, and no more bytes than a file may unpack to."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from pathlib import Path, PurePath

from service.errors import RequestError
from service.files.zips import member_blocks, opened_zip

from .features import Allowance, Foreign
from .gpx_reading import read_gpx
from .kml_reading import read_kml
from .plan_reading import read_plan

__all__ = ["FOREIGN_SUFFIXES", "read_foreign", "read_foreign_file"]

# a document larger than this is no plan of a mission; packed or not
MOST_BYTES = 32 * 1024 * 1024
MOST_MEMBERS = 10_000
READERS: Mapping[str, Callable[[bytes, Allowance], Foreign]] = {".kml": read_kml, ".gpx": read_gpx, ".plan": read_plan}
FOREIGN_SUFFIXES = (".kml", ".kmz", ".gpx", ".plan")


def read_foreign_file(path: Path, most_places: int | None = None) -> Foreign:
    """The places in a file, by its suffix; one of more than most_places is not read on. Raises RequestError."""
    try:
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise RequestError(f"The file {str(path)!r} cannot be read: {error.strerror}.") from error
    return read_foreign(path.name, data, most_places)


def read_foreign(name: str, data: bytes, most_places: int | None = None) -> Foreign:
    """The places in a file of that name. Raises RequestError."""
    called, suffix = f"The file {name}", PurePath(name).suffix.lower()
    if suffix == ".kmz":
        return read_kml(_document_in(data, called), Allowance(called, most_places))
    if len(data) > MOST_BYTES:
        raise RequestError(f"{called} has more than {MOST_BYTES:,} bytes, which no plan of a mission needs.")
    return READERS[suffix](data, Allowance(called, most_places))


def _document_in(data: bytes, called: str) -> bytes:
    """The first KML document of a KMZ, which is the one that it is about."""
    damaged = f"{called} is no KMZ that can be read: damaged, encrypted, or packed in a way that KMZ does not know."
    document = bytearray()
    with opened_zip(io.BytesIO(data), damaged) as archive:
        members = archive.infolist()
        if len(members) > MOST_MEMBERS:
            raise RequestError(f"{called} holds {len(members):,} files, which no KMZ needs.")
        documents = [one for one in members if one.filename.lower().endswith(".kml")]
        if not documents:
            raise RequestError(f"{called} is a zip without a KML document.")
        for block in member_blocks(archive, documents[0], damaged):
            document += block
            if len(document) > MOST_BYTES:
                raise RequestError(
                    f"{called} unpacks to more than {MOST_BYTES:,} bytes, which no plan of a mission needs."
                )
    return bytes(document)
