"""The store's schema, version by version: a new store takes every step, an older one those that it lacks.

A step is never edited once it was released: stores that took it would differ from those to come. What is added is
another step at the end, with a default for the rows that are there, and a store of the version before goes into
``tests/service/jobs/older_stores``.
"""

from __future__ import annotations

import logging
import sqlite3
from contextlib import closing
from pathlib import Path

from service.errors import DataFolderError

__all__ = ["SCHEMA_VERSION", "STEPS", "copy_before", "migrate", "refuse_newer", "version_of"]

logger = logging.getLogger("sightline.jobs")

# STEPS[n] makes version n + 1 of version n
STEPS = (
    """
    CREATE TABLE dems (
        id TEXT PRIMARY KEY, name TEXT NOT NULL, created_at_s REAL NOT NULL, summary TEXT NOT NULL
    ) STRICT;
    CREATE TABLE jobs (
        id TEXT PRIMARY KEY, kind TEXT NOT NULL, dem_id TEXT NOT NULL, request TEXT NOT NULL, status TEXT NOT NULL,
        created_at_s REAL NOT NULL, started_at_s REAL, finished_at_s REAL, attempts INTEGER NOT NULL DEFAULT 0,
        digest TEXT, summary TEXT, failure TEXT
    ) STRICT;
    CREATE INDEX jobs_by_kind ON jobs (kind, created_at_s);
    CREATE INDEX jobs_by_status ON jobs (status);
    CREATE INDEX jobs_by_digest ON jobs (digest);
    """,
    # pages in the order of an index; what is kept for good, and how many bytes each result takes
    """
    DROP INDEX jobs_by_kind;
    CREATE INDEX jobs_newest ON jobs (kind, created_at_s DESC, id);
    ALTER TABLE jobs ADD COLUMN pinned INTEGER NOT NULL DEFAULT 0;
    CREATE INDEX jobs_over ON jobs (finished_at_s) WHERE finished_at_s IS NOT NULL;
    CREATE TABLE results (digest TEXT PRIMARY KEY, bytes INTEGER NOT NULL) STRICT;
    """,
    # missions, and each as it was
    """
    CREATE TABLE missions (
        id TEXT PRIMARY KEY, name TEXT NOT NULL, dem_sha256 TEXT, ground TEXT, anchors INTEGER NOT NULL,
        created_at_s REAL NOT NULL, saved_at_s REAL NOT NULL, version INTEGER NOT NULL, saved_by TEXT
    ) STRICT;
    CREATE INDEX missions_newest ON missions (saved_at_s DESC, id);
    CREATE TABLE mission_versions (
        mission_id TEXT NOT NULL, version INTEGER NOT NULL, name TEXT, saved_at_s REAL NOT NULL, saved_by TEXT,
        document TEXT NOT NULL, PRIMARY KEY (mission_id, version)
    ) STRICT, WITHOUT ROWID;
    """,
    # whose everything is: what was there belongs to the tenant of whoever needs no key
    """
    ALTER TABLE dems ADD COLUMN tenant TEXT NOT NULL DEFAULT 'default';
    ALTER TABLE jobs ADD COLUMN tenant TEXT NOT NULL DEFAULT 'default';
    ALTER TABLE missions ADD COLUMN tenant TEXT NOT NULL DEFAULT 'default';
    CREATE INDEX dems_of_tenants ON dems (tenant, created_at_s DESC, id);
    DROP INDEX jobs_newest;
    CREATE INDEX jobs_of_tenants ON jobs (tenant, kind, created_at_s DESC, id);
    DROP INDEX missions_newest;
    CREATE INDEX missions_of_tenants ON missions (tenant, saved_at_s DESC, id);
    CREATE TABLE tenants (name TEXT PRIMARY KEY, salt TEXT NOT NULL) STRICT;
    CREATE TABLE spent (
        tenant TEXT NOT NULL, hour INTEGER NOT NULL, seconds REAL NOT NULL, PRIMARY KEY (tenant, hour)
    ) STRICT, WITHOUT ROWID;
    """,
    # few jobs wait or run, and nearly all are over: an index of every status leads planners to those
    """
    DROP INDEX jobs_by_status;
    CREATE INDEX jobs_active ON jobs (created_at_s, id) WHERE status IN ('queued', 'running');
    """,
)
SCHEMA_VERSION = len(STEPS)


def version_of(connection: sqlite3.Connection, path: Path) -> int:
    """The version of a store's schema, 0 of an empty file. Raises DataFolderError when a newer Sightline wrote it."""
    version = int(connection.execute("PRAGMA user_version").fetchone()[0])
    refuse_newer(version, str(path))
    return version


def refuse_newer(version: int, what: str) -> None:
    """Raises DataFolderError for a store of a version that is still to come."""
    if version > SCHEMA_VERSION:
        raise DataFolderError(
            f"{what} was written by a newer Sightline (store version {version}, this one knows {SCHEMA_VERSION}) and "
            "is left as it is; use that Sightline, or restore a backup that was made before."
        )


def migrate(connection: sqlite3.Connection, path: Path) -> None:
    """Bring the store up to this version, in one transaction.

    A store of an older version is copied first, as it is (``copy_before``): to go back, put the copy in its place.
    Raises DataFolderError (a newer store); sqlite3.DatabaseError and OSError leave the store as it was.
    """
    version = version_of(connection, path)
    if version == SCHEMA_VERSION:
        return
    if version > 0:
        _copy(connection, copy_before(path, version))
    steps = "".join(STEPS[version:])
    try:
        connection.executescript(f"BEGIN IMMEDIATE; {steps} PRAGMA user_version = {SCHEMA_VERSION}; COMMIT;")
    finally:
        if connection.in_transaction:
            connection.execute("ROLLBACK")
    if version > 0:
        logger.warning(
            "%s was of version %d and is of version %d now; as it was it lies in %s, which may be deleted",
            *(path, version, SCHEMA_VERSION, copy_before(path, version)),
        )


def copy_before(path: Path, version: int) -> Path:
    """Where a store of that version is kept when it is migrated."""
    return path.with_name(f"{path.name}.version-{version}")


def _copy(connection: sqlite3.Connection, target: Path) -> None:
    unfinished = target.with_name(f"{target.name}.unfinished")
    unfinished.unlink(missing_ok=True)
    try:
        with closing(sqlite3.connect(unfinished)) as copy:
            connection.backup(copy)
            copy.execute("PRAGMA journal_mode = DELETE")
        unfinished.replace(target)
    finally:
        unfinished.unlink(missing_ok=True)
