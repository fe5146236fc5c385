"""A store as a file, also one that another process works with: its tables, what it knows, copies, what errors mean."""

from __future__ import annotations

import json
import re
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path

from service.database import READ, Connection
from service.database.migrations import STEPS, version_of
from service.errors import DataFolderError, ServiceError, StorageFullError, StoreLockedError

from .records import ACTIVE, JobStatus, Known, has_inputs

__all__ = [
    "IS_ACTIVE",
    "SIDE_FILES",
    "StoredRow",
    "copied",
    "dem_digests_in",
    "error_of_store",
    "forget",
    "is_store",
    "known_to",
    "read_known",
    "rewrite",
    "settle",
    "snapshot",
]

# a DEM or a job as it is stored, by column
StoredRow = Mapping[str, str | int | float | None]

IS_ACTIVE = f"status IN ({', '.join(repr(str(status)) for status in ACTIVE)})"
HAS_MISSIONS = "SELECT name FROM sqlite_schema WHERE name = 'missions'"  # stores before version 3 have none

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
MAGIC = b"SQLite format 3\0"
# what SQLite keeps beside a database while it is used; after a crash the write-ahead log holds the newest changes
SIDE_FILES = ("-wal", "-shm", "-journal")
WAIT_MS = 5000
# ids are names of folders: none may lead elsewhere
ID = re.compile(r"[0-9a-f]{32}")


def read_known(connection: Connection, *, missions: bool = True) -> Known:
    """Every DEM, job and result that a store knows, within a transaction. missions: whether it has a table of them."""
    active = connection.execute(f"SELECT * FROM jobs WHERE {IS_ACTIVE}").fetchall()
    jobs, whole, lost = set[str](), set[str](), set[str]()
    for id, digest, status in connection.execute("SELECT id, digest, status FROM jobs"):
        jobs.add(str(id))
        if digest is not None:
            (whole if status == JobStatus.SUCCEEDED else lost).add(str(digest))
    return Known(
        dems=frozenset(row[0] for row in connection.execute("SELECT id FROM dems")),
        jobs=frozenset(jobs),
        jobs_over=frozenset(jobs.difference(row["id"] for row in active)),
        digests=frozenset(whole | lost),
        whole=frozenset(whole),
        lost=frozenset(lost),
        inputs=frozenset(str(row["id"]) for row in active if has_inputs(row["kind"], json.loads(row["request"]))),
        missions=connection.execute("SELECT count(*) FROM missions").fetchone()[0] if missions else 0,
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
            version_of(connection, path)
            if told != "ok" or not _tables(connection) >= _tables_of_ours():
                raise DataFolderError(f"The job store {path} is damaged ({' '.join(str(told).split())}).")
            connection.execute(READ)
            known = read_known(connection, missions=connection.execute(HAS_MISSIONS).fetchone() is not None)
            connection.execute("COMMIT")
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


def rewrite(path: Path) -> tuple[int, int]:
    """Write a store that nobody works with anew, without room of what was deleted; its bytes before and after.

    Raises DataFolderError, also when the disk has no room for the new file; the store is then as it was.
    """
    try:
        settle(path)
        before = path.stat().st_size
        with closing(_opened(path)) as connection:
            connection.execute("VACUUM")
    except (sqlite3.DatabaseError, OSError) as error:
        raise DataFolderError(f"The job store {path} cannot be written anew ({error}); it is as it was.") from error
    return before, path.stat().st_size


def _opened(path: Path) -> sqlite3.Connection:
    # an address, because a path would make a new file where there is none
    connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode=rw", uri=True, isolation_level=None)
    connection.row_factory = sqlite3.Row
    connection.execute(f"PRAGMA busy_timeout = {WAIT_MS}")
    return connection


def _tables_of_ours() -> set[tuple[str, str]]:
    """What every store of ours has, the oldest too."""
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(STEPS[0])
        return _tables(connection)


def _tables(connection: sqlite3.Connection) -> set[tuple[str, str]]:
    """(table, column) of every column."""
    return {
        (table, row[1])
        for table in ("dems", "jobs")
        for row in connection.execute(f"PRAGMA table_info({table})").fetchall()
    }
