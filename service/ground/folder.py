"""Where the ground library lies: an index in the data folder, beside the store; the tiles stay where they are."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from service.errors import DataFolderError
from service.jobs.marker import FolderKind, kind_of, mark
from terrain import GroundLibrary, read_library

__all__ = ["LIBRARY", "claimed", "library_in"]

LIBRARY = "ground.json"


def claimed(root: Path) -> Path:
    """The library's file in a data folder, which is made where there is none; a service may be using it.

    Raises DataFolderError where the folder is somebody else's or a backup.
    """
    root = root.absolute()
    try:
        root.mkdir(parents=True, exist_ok=True)
        kind = kind_of(root)
        if kind is FolderKind.EMPTY:
            mark(root, FolderKind.DATA)
    except OSError as error:
        raise DataFolderError(f"The data folder {root} cannot be used: {error.strerror}.") from error
    if kind is FolderKind.BACKUP:
        raise DataFolderError(f"{root} is a backup, which stays as it is; name a data folder.")
    return root / LIBRARY


def library_in(root: Path) -> GroundLibrary:
    """The library of a data folder, read again only when it was changed. Raises DemReadError."""
    path = root / LIBRARY
    try:
        found = path.stat()
    except OSError:
        return GroundLibrary()
    return _read(path, found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=2)
def _read(path: Path, modified_ns: int, size_bytes: int) -> GroundLibrary:
    return read_library(path)
