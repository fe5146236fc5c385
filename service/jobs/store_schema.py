"""The tables of the job store."""

from __future__ import annotations

import sqlite3

from .records import ACTIVE, OLDER_WITH_INPUTS, Known

__all__ = ["IS_ACTIVE", "SCHEMA", "SCHEMA_VERSION", "read_known"]

SCHEMA_VERSION = 1
SCHEMA = """
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
"""
IS_ACTIVE = f"status IN ({', '.join(repr(str(status)) for status in ACTIVE)})"
HAS_INPUTS = (
    "coalesce(json_extract(request, '$.has_inputs'), kind IN "
    f"({', '.join(repr(kind) for kind in sorted(OLDER_WITH_INPUTS))}))"
)


def read_known(connection: sqlite3.Connection) -> Known:
    """Every DEM, job and result that a store knows."""

    def column(query: str) -> frozenset[str]:
        return frozenset(str(row[0]) for row in connection.execute(query))

    connection.execute("BEGIN")
    try:
        return Known(
            dems=column("SELECT id FROM dems"),
            jobs=column("SELECT id FROM jobs"),
            jobs_over=column(f"SELECT id FROM jobs WHERE NOT {IS_ACTIVE}"),
            digests=column("SELECT DISTINCT digest FROM jobs WHERE digest IS NOT NULL"),
            inputs=column(f"SELECT id FROM jobs WHERE {IS_ACTIVE} AND {HAS_INPUTS}"),
        )
    finally:
        connection.execute("COMMIT")
