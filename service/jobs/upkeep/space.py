"""Room on the disk of the data folder: how much is left, and a reserve that is given up so that DELETE works."""

from __future__ import annotations

import logging
import os
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import ParamSpec, TypeVar

from service.errors import StorageFullError
from service.jobs.folder import is_full

__all__ = ["Space"]

logger = logging.getLogger("sightline.space")

P = ParamSpec("P")
R = TypeVar("R")
MIB = 1024 * 1024
# of a small disk, a twentieth is little room, and a hundredth is kept in reserve
LITTLE, RESERVED = 20, 100
RESERVE_BYTES = 8 * MIB
FEWEST_FILES = 1000


class Space:
    """``look`` touches the disk; all else tells what it saw last. Safe to use from any thread."""

    def __init__(self, root: Path, min_free_bytes: int) -> None:
        self._root = root
        self._min_free_bytes = min_free_bytes
        self._reserve = root / "reserve"
        self.free_bytes = 0
        self.least_bytes = 0
        self.low = False

    def look(self) -> None:
        """See how much is left, and take the reserve back when there is enough. Raises OSError."""
        disk = os.statvfs(self._root)
        total_bytes = disk.f_blocks * disk.f_frsize
        self.free_bytes = disk.f_bavail * disk.f_frsize
        self.least_bytes = min(self._min_free_bytes, total_bytes // LITTLE)
        # some file systems make room for files as they are needed, and count none
        few_files = disk.f_files > 0 and disk.f_favail < min(FEWEST_FILES, disk.f_files // LITTLE)
        low = self.free_bytes < self.least_bytes or few_files
        if low and not self.low:
            logger.error(
                "%d MB and %d files are left on the disk of %s: new work is refused until things are deleted",
                *(self.free_bytes // 1_000_000, disk.f_favail, self._root),
            )
        elif self.low and not low:
            logger.warning("there is room again on the disk of %s", self._root)
        self.low = low
        reserve_bytes = min(RESERVE_BYTES, total_bytes // RESERVED)
        if not self._reserve.exists() and self.free_bytes >= self.least_bytes + 2 * reserve_bytes:
            self._put_by(reserve_bytes)

    def refuse_when_low(self) -> None:
        """Raises StorageFullError before anything is taken in that could not be kept."""
        if self.low:
            raise StorageFullError(
                f"The disk of the data folder is nearly full ({self.free_bytes / MIB:,.0f} MiB left, "
                f"{self.least_bytes / MIB:,.0f} MiB and some files are kept free by SIGHTLINE_MIN_FREE_BYTES); delete "
                "results or DEMs that are not needed, or make room on the disk, and try again."
            )

    def freeing(self, work: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Do what deletes; where the disk is too full even for that, the reserve is given up and it is done again."""
        try:
            return work(*args, **kwargs)
        except (sqlite3.OperationalError, OSError) as error:
            if not _for_want_of_room(error) or not self._reserve.exists():
                raise
            logger.warning("the disk is full (%s); the reserve is given up to delete", error)
            self._reserve.unlink(missing_ok=True)
        return work(*args, **kwargs)

    def _put_by(self, reserve_bytes: int) -> None:
        try:
            with self._reserve.open("wb") as file:
                os.posix_fallocate(file.fileno(), 0, reserve_bytes)
        except OSError as error:
            # a limit on the size of files, or a file system that cannot: then nothing is put by
            logger.info("no reserve on the disk of %s: %s", self._root, error)
            self._reserve.unlink(missing_ok=True)


def _for_want_of_room(error: sqlite3.OperationalError | OSError) -> bool:
    if isinstance(error, OSError):
        return is_full(error)
    # the low byte is the kind of error; memory shared beside a store that cannot grow is an error of input and output
    return error.sqlite_errorcode & 0xFF in (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR)
