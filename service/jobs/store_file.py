"""A store as a file, also one that another process works with: is it one, what does it know, and copies of it."""

from __future__ import annotations

import json
import re
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from service.errors import DataFolderError

from .records import Known
from .store_schema import SCHEMA, SCHEMA_VERSION, read_known

__all__ = ["SIDE_FILES", "copied", "dem_digests_in", "forget", "is_store", "known_to", "settle", "snapshot"]

MAGIC = b"SQLite format 3\0"
# what SQLite keeps beside a database while it is used; after a crash the write-ahead log holds the newest changes
SIDE_FILES = ("-wal", "-shm", "-journal")
WAIT_MS = 5000
# ids are names of folders: none may lead elsewhere
ID = re.compile(r"[0-9a-f]{32}")


def is_store(path: Path) -> bool:
    """Whether a file is a store of ours. It is looked at in a copy, since looking makes SQLite write beside it."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            return False
    try:
        with copied(path) as copy, closing(sqlite3.connect(copy)) as connection:
            return _tables(connection) >= _tables_of_ours()
    except sqlite3.DatabaseError:
        return False


@contextmanager
def copied(path: Path) -> Iterator[Path]:
    """A copy of a store that nobody works with, for as long as the block lasts."""
    with tempfile.TemporaryDirectory(prefix="sightline-store-") as place:
        copy = Path(place) / path.name
        shutil.copyfile(path, copy)
        log = path.with_name(f"{path.name}-wal")
        if log.is_file():
            shutil.copyfile(log, copy.with_name(log.name))
        yield copy


def known_to(path: Path) -> Known:
    """What a store knows, after its pages were checked. Raises DataFolderError where it is damaged or a newer one's."""
    if not path.is_file():
        raise DataFolderError(f"The job store {path} is missing.")
    try:
        with closing(_opened(path)) as connection:
            (told,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
            version = connection.execute("PRAGMA user_version").fetchone()[0]
            if version > SCHEMA_VERSION:
                raise DataFolderError(f"{path} was written by a newer Sightline (store version {version}).")
            if told != "ok" or not _tables(connection) >= _tables_of_ours():
                raise DataFolderError(f"The job store {path} is damaged ({' '.join(str(told).split())}).")
            known = read_known(connection)
            for name in known.dems | known.jobs | known.digests:
                if not ID.fullmatch(name):
                    raise DataFolderError(f"The job store {path} is damaged (it calls something {name[:80]!r}).")
            return known
    except sqlite3.DatabaseError as error:
        raise DataFolderError(f"The job store {path} cannot be read ({error}).") from error


def snapshot(source: Path, target: Path) -> None:
    """Copy a store as it is at one moment, also while it is written; the copy is a single file.

    Raises DataFolderError.
    """
    try:
        with closing(_opened(source)) as live, closing(sqlite3.connect(target)) as copy:
            live.backup(copy)
            copy.execute("PRAGMA journal_mode = DELETE")
    except sqlite3.DatabaseError as error:
        raise DataFolderError(f"The job store {source} cannot be read ({error}).") from error


def dem_digests_in(path: Path) -> dict[str, str]:
    """SHA-256 of every DEM's grid, by the DEM's id. Raises sqlite3.DatabaseError."""
    with closing(_opened(path)) as connection:
        rows = connection.execute("SELECT id, summary FROM dems").fetchall()
    return {dem_id: str(json.loads(summary).get("sha256")) for dem_id, summary in rows}


def forget(path: Path, part: str, name: str) -> None:
    """Take a DEM, the jobs of a result, or the job of some inputs out of a copy of a store."""
    column = {"dems": "dems WHERE id", "results": "jobs WHERE digest", "inputs": "jobs WHERE id"}[part]
    with closing(_opened(path)) as connection:
        connection.execute(f"DELETE FROM {column} = ?", (name,))


def settle(path: Path) -> bool:
    """Bring a store that nobody works with into its one file; whether that could be done."""
    try:
        with closing(_opened(path)) as connection:
            busy = connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()[0]
            connection.execute("PRAGMA journal_mode = DELETE")
    except sqlite3.DatabaseError:
        return False
    return not busy


def _opened(path: Path) -> sqlite3.Connection:
    # an address, because a path would make a new file where there is none
    connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode=rw", uri=True, isolation_level=None)
    connection.execute(f"PRAGMA busy_timeout = {WAIT_MS}")
    return connection


def _tables_of_ours() -> set[tuple[str, str]]:
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(SCHEMA)
        return _tables(connection)


def _tables(connection: sqlite3.Connection) -> set[tuple[str, str]]:
    """(table, column) of every column."""
    return {
        (table, row[1])
        for table in ("dems", "jobs")
        for row in connection.execute(f"PRAGMA table_info({table})").fetchall()
    }
