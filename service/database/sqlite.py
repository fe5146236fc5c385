"""The store's tables in a file of SQLite: one connection writes, every change one transaction, another reads."""

from __future__ import annotations

import os
import sqlite3
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from service.database.migrations import SCHEMA_VERSION, migrate, version_of
from service.errors import DataFolderError

from . import READ, WRITE, Begin

__all__ = ["SqliteDatabase"]


class SqliteDatabase:
    """A file. sqlite3.DatabaseError passes through when the disk is full, or another program holds the file.

    Raises DataFolderError when the file is not a store, of a newer version, damaged, or was removed since.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            writing = _opened(path)
            writing.execute("PRAGMA journal_mode = WAL")
            # an accepted job must outlive a power cut, not only a crash
            writing.execute("PRAGMA synchronous = FULL")
            _prepare(writing, path)
            # with one of its own, who reads waits for no disk that a change is being written to
            reading = _opened(path)
            reading.execute("PRAGMA query_only = ON")
            self._lines = {WRITE: (threading.Lock(), writing), READ: (threading.Lock(), reading)}
            self._file = path.stat()
        except (sqlite3.DatabaseError, OSError) as error:
            locked = isinstance(error, sqlite3.OperationalError | OSError)  # or a right is missing: that is no damage
            cure = "" if locked else "; `sightline store restore` puts a backup in its place"
            raise DataFolderError(f"{path} cannot be used as the job store: {error}{cure}.") from error

    def close(self) -> None:
        """Close the file."""
        for lock, connection in reversed(self._lines.values()):  # the one that writes clears up, as the last
            with lock:
                connection.close()

    @property
    def size_bytes(self) -> int:
        """Bytes of the file, and of what SQLite keeps beside it."""
        files = [self._path.with_name(f"{self._path.name}{suffix}") for suffix in ("", "-wal", "-shm")]
        return sum(file.stat().st_size for file in files if file.is_file())

    def check_writable(self) -> None:
        """Raise sqlite3.OperationalError when nothing can be written."""
        with self.transaction() as connection:
            connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")

    @contextmanager
    def transaction(self, begin: Begin = WRITE) -> Iterator[sqlite3.Connection]:
        """All or nothing, also for what others keep in the same file."""
        lock, connection = self._lines[begin]
        with lock:
            self._check_in_place()
            connection.execute(begin)
            try:
                yield connection
                connection.execute("COMMIT")
            finally:
                # SQLite has rolled back by itself when the disk was full
                if connection.in_transaction:
                    connection.execute("ROLLBACK")

    def _check_in_place(self) -> None:
        # of a file that was deleted SQLite reads and writes what is left, and all seems well but incomplete
        try:
            in_place = os.path.samestat(self._path.stat(), self._file)
        except OSError:
            in_place = False
        if not in_place:
            raise DataFolderError(
                f"The job store {self._path} is gone, or is not the one that the service started with; put the data "
                "folder back, or restart the service."
            )


def _opened(path: Path) -> sqlite3.Connection:
    connection = sqlite3.connect(path, check_same_thread=False, isolation_level=None)
    connection.row_factory = sqlite3.Row
    connection.execute("PRAGMA busy_timeout = 5000")
    return connection


def _prepare(connection: sqlite3.Connection, path: Path) -> None:
    version_of(connection, path)
    # pages of two stores, where one was put back beside the other's write-ahead log, would be written on
    (told,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    if told != "ok":
        raise DataFolderError(
            f"{path} is damaged ({' '.join(told.split())}) and left as it is; `sightline store restore` puts a "
            "backup in its place."
        )
    migrate(connection, path)
