"""The one place that knows pyrtklib: its numbers for systems and satellites, and files that it reads by name."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

from gnss.errors import GnssLibraryError

__all__ = [
    "SYSTEMS",
    "CStruct",
    "a_file",
    "default_options",
    "gtime",
    "rtklib",
    "satellite_names",
    "satellite_numbers",
    "seconds_of",
]

CStruct = Any  # pyrtklib's structs have no types that could be checked

# RTKLIB's bits of the systems whose carriers it combines here, by the letters that RINEX has for them
SYSTEMS = {"G": 0x01, "R": 0x04, "E": 0x08, "J": 0x10, "C": 0x20}
UNIX_EPOCH_OF_GPS_S = 315_964_800


@lru_cache(maxsize=1)
def rtklib() -> ModuleType:
    """pyrtklib. Raises GnssLibraryError with the words to install it."""
    try:
        import pyrtklib
    except ImportError as error:
        raise GnssLibraryError('Differential positions need RTKLIB: pip install "sightline[rtk]" brings it.') from error
    library: ModuleType = pyrtklib
    return library


@lru_cache(maxsize=1)
def satellite_names() -> dict[int, str]:
    """RTKLIB's numbers of satellites and their RINEX names, G05."""
    library, number = rtklib(), 1
    names: dict[int, str] = {}
    while True:
        characters = library.Arr1Dchar(8)
        library.satno2id(number, characters)
        name = str(characters[0])  # an element of such an array reads as the string that begins there
        if not name:
            return names
        names[number] = name
        number += 1


@lru_cache(maxsize=1)
def satellite_numbers() -> dict[str, int]:
    """The inverse of ``satellite_names``."""
    return {name: number for number, name in satellite_names().items()}


def default_options() -> CStruct:
    """A copy of RTKLIB's default options, which every caller in the process shares."""
    library = rtklib()
    default, fresh = library.prcopt_default, library.prcopt_t()
    for name in dir(fresh):
        value = getattr(default, name)
        if isinstance(value, int | float) and not name.startswith("_"):
            setattr(fresh, name, value)
    for name, count in (("eratio", 3), ("err", 5), ("std", 3), ("prn", 6), ("thresar", 8)):
        for n in range(count):
            getattr(fresh, name)[n] = getattr(default, name)[n]
    return fresh


def seconds_of(time: CStruct) -> tuple[int, float]:
    """Whole seconds of GPS time since 1980-01-06, and the rest, of RTKLIB's time."""
    return int(time.time) - UNIX_EPOCH_OF_GPS_S, float(time.sec)


def gtime(whole_s: int, part_s: float) -> CStruct:
    """The inverse of ``seconds_of``."""
    time = rtklib().gtime_t()
    time.time, time.sec = int(whole_s) + UNIX_EPOCH_OF_GPS_S, float(part_s)
    return time


@contextmanager
def a_file(text: str, ending: str) -> Iterator[str]:
    """The path of a passing file with that text: RTKLIB opens files by name, and expands what is special in it."""
    with tempfile.TemporaryDirectory(prefix="rinex-") as folder:
        path = Path(folder) / f"file.{ending}"
        path.write_text(text, encoding="latin-1")
        yield str(path)
