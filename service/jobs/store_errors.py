"""What an error of the job store's database means for whoever asked."""

from __future__ import annotations

import sqlite3

from service.errors import DataFolderError, ServiceError, StorageFullError, StoreLockedError

__all__ = ["error_of_store"]

LOCKED = frozenset({sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED})
UNUSABLE = frozenset(
    {
        sqlite3.SQLITE_CANTOPEN,
        sqlite3.SQLITE_CORRUPT,
        sqlite3.SQLITE_IOERR,
        sqlite3.SQLITE_NOTADB,
        sqlite3.SQLITE_PERM,
        sqlite3.SQLITE_READONLY,
    }
)


def error_of_store(error: sqlite3.DatabaseError) -> ServiceError | None:
    """The error as one of ours, with its sentence; None when it is a fault."""
    # the low byte is the kind of error, the others its details
    code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF
    if code in LOCKED:
        return StoreLockedError(
            "The database of the job store is locked by another program (sightline.sqlite3 in the data folder); "
            "close that program and try again."
        )
    if code == sqlite3.SQLITE_FULL:
        return StorageFullError("The job store cannot be written; make room on the disk and try again.")
    if code in UNUSABLE:
        return DataFolderError(
            f"The job store in the data folder cannot be used ({error}); put the data folder in order, then restart "
            "the service."
        )
    return None
