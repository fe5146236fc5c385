"""The memory of the service: DEMs and jobs in SQLite, one connection, every change one transaction."""

from __future__ import annotations

import os
import sqlite3
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Literal

from pydantic import JsonValue

from service.errors import DataFolderError, InUseError, NotFoundError

from .migrations import SCHEMA_VERSION, migrate, version_of
from .records import DemRecord, Failure, JobRecord, JobStatus, Known, as_json, dem_of, failure_text, job_of
from .sharing.tenants import own_id, salt_of, seen, spend
from .store_file import IS_ACTIVE, StoredRow, read_known

__all__ = ["Store"]


class Store:
    """DEMs and jobs. Every method is one transaction and safe to call from any thread.

    Raises DataFolderError when the file is not a store, of a newer version, or was removed since. sqlite3.DatabaseError
    passes through when the disk is full, or another program holds the file: ``store_errors`` tells which.
    """

    def __init__(self, path: Path) -> None:
        self._lock = threading.Lock()
        self._path = path
        try:
            self._connection = sqlite3.connect(path, check_same_thread=False, isolation_level=None)
            self._connection.row_factory = sqlite3.Row
            self._connection.execute("PRAGMA busy_timeout = 5000")
            self._connection.execute("PRAGMA journal_mode = WAL")
            # an accepted job must outlive a power cut, not only a crash
            self._connection.execute("PRAGMA synchronous = FULL")
            self._prepare(path)
            self._file = path.stat()
        except (sqlite3.DatabaseError, OSError) as error:
            locked = isinstance(error, sqlite3.OperationalError | OSError)  # or a right is missing: that is no damage
            cure = "" if locked else "; `sightline store restore` puts a backup in its place"
            raise DataFolderError(f"{path} cannot be used as the job store: {error}{cure}.") from error

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._connection.close()

    def check_writable(self) -> None:
        """Raise sqlite3.OperationalError when nothing can be written."""
        with self._transaction() as connection:
            connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")

    # -- DEMs

    def add_dem(self, dem: DemRecord) -> None:
        """Remember a DEM; one that is known already stays as it is."""
        with self._transaction() as connection:
            connection.execute(
                "INSERT INTO dems (id, name, created_at_s, summary, tenant) VALUES (?, ?, ?, ?, ?) "
                "ON CONFLICT (id) DO NOTHING",
                (dem.id, dem.name, dem.created_at_s, as_json(dem.summary), dem.tenant),
            )

    def dem(self, dem_id: str) -> DemRecord:
        """Raises NotFoundError."""
        found = self.dem_or_none(dem_id)
        if found is None:
            raise NotFoundError("DEM", dem_id)
        return found

    def dem_or_none(self, dem_id: str) -> DemRecord | None:
        """The DEM, when there is one of that id."""
        mine, whose = seen()
        with self._reading() as connection:
            row = connection.execute(f"SELECT * FROM dems WHERE id = ? AND {mine}", (dem_id, *whose)).fetchone()
        return None if row is None else dem_of(row)

    def dems(self, limit: int, offset: int) -> tuple[list[DemRecord], int]:
        """One page, newest first, and how many there are in all."""
        mine, whose = seen()
        with self._reading() as connection:
            total = connection.execute(f"SELECT count(*) FROM dems WHERE {mine}", whose).fetchone()[0]
            rows = connection.execute(
                f"SELECT * FROM dems WHERE {mine} ORDER BY created_at_s DESC, id LIMIT ? OFFSET ?",
                (*whose, limit, offset),
            ).fetchall()
        return [dem_of(row) for row in rows], total

    def remove_dem(self, dem_id: str) -> None:
        """Forget a DEM; raises NotFoundError, and InUseError while jobs on it wait or run."""
        mine, whose = seen()
        with self._transaction() as connection:
            if connection.execute(f"SELECT 1 FROM dems WHERE id = ? AND {mine}", (dem_id, *whose)).fetchone() is None:
                raise NotFoundError("DEM", dem_id)
            users = connection.execute(
                f"SELECT count(*) FROM jobs WHERE dem_id = ? AND {IS_ACTIVE}", (dem_id,)
            ).fetchone()[0]
            if users:
                raise InUseError(
                    f"DEM {dem_id} is needed by {users} job{'s' if users > 1 else ''} that "
                    f"{'are' if users > 1 else 'is'} not finished; delete {'them' if users > 1 else 'it'} first."
                )
            connection.execute("DELETE FROM dems WHERE id = ?", (dem_id,))

    # -- tenants

    def own_id(self, id: str) -> str:
        """The acting tenant's own id of a DEM that has this one by its content."""
        with self._transaction() as connection:
            return own_id(connection, id)

    def salt(self, tenant: str) -> str:
        """What sets the digests of a tenant's results apart."""
        with self._transaction() as connection:
            return salt_of(connection, tenant)

    # -- jobs

    def add_job(self, job: JobRecord) -> None:
        """Remember a new job; raises NotFoundError when its DEM is gone."""
        columns = (job.id, job.kind, job.dem_id, as_json(job.request), job.status, job.created_at_s, job.tenant)
        of_the_job = "SELECT 1 FROM dems WHERE id = ? AND tenant = ?"
        with self._transaction() as connection:
            if connection.execute(of_the_job, (job.dem_id, job.tenant)).fetchone() is None:
                raise NotFoundError("DEM", job.dem_id)
            connection.execute(
                "INSERT INTO jobs (id, kind, dem_id, request, status, created_at_s, tenant) VALUES (?,?,?,?,?,?,?)",
                columns,
            )

    def job(self, kind: str, job_id: str) -> JobRecord:
        """Raises NotFoundError."""
        mine, whose = seen()
        query = f"SELECT * FROM jobs WHERE id = ? AND kind = ? AND {mine}"
        with self._reading() as connection:
            row = connection.execute(query, (job_id, kind, *whose)).fetchone()
        if row is None:
            raise NotFoundError(kind, job_id)
        return job_of(row)

    def jobs(self, kind: str, limit: int, offset: int) -> tuple[list[JobRecord], int]:
        """One page, newest first, and how many there are in all."""
        mine, whose = seen()
        query = f"FROM jobs WHERE {mine} AND kind = ?"
        with self._reading() as connection:
            total = connection.execute(f"SELECT count(*) {query}", (*whose, kind)).fetchone()[0]
            rows = connection.execute(
                f"SELECT * {query} ORDER BY created_at_s DESC, id LIMIT ? OFFSET ?", (*whose, kind, limit, offset)
            ).fetchall()
        return [job_of(row) for row in rows], total

    def start_job(self, job_id: str) -> None:
        """A worker takes the job: one attempt more."""
        with self._transaction() as connection:
            connection.execute(
                "UPDATE jobs SET status = ?, started_at_s = ?, attempts = attempts + 1 WHERE id = ?",
                (JobStatus.RUNNING, time.time(), job_id),
            )

    def requeue_job(self, job_id: str, *, forget_attempt: bool = False) -> None:
        """A running job waits again; forget_attempt when it was not its fault."""
        with self._transaction() as connection:
            connection.execute(
                "UPDATE jobs SET status = ?, started_at_s = NULL, attempts = max(0, attempts - ?) WHERE id = ?",
                (JobStatus.QUEUED, int(forget_attempt), job_id),
            )

    def finish_job(
        self,
        job_id: str,
        status: JobStatus,
        *,
        digest: str | None = None,
        summary: Mapping[str, JsonValue] | None = None,
        failure: Failure | None = None,
    ) -> None:
        """The job is over, one way or another."""
        now_s = time.time()
        with self._transaction() as connection:
            spend(connection, job_id, now_s)
            connection.execute(
                "UPDATE jobs SET status = ?, finished_at_s = ?, digest = ?, summary = ?, failure = ? WHERE id = ?",
                (
                    status,
                    now_s,
                    digest,
                    None if summary is None else as_json(summary),
                    None if failure is None else failure_text(failure),
                    job_id,
                ),
            )

    def remove_job(self, job_id: str) -> str | None:
        """Forget a job; the digest of its result comes back when no other job shares it."""
        with self._transaction() as connection:
            row = connection.execute("DELETE FROM jobs WHERE id = ? RETURNING digest", (job_id,)).fetchone()
            if row is None or row["digest"] is None:
                return None
            shared = connection.execute("SELECT 1 FROM jobs WHERE digest = ?", (row["digest"],)).fetchone()
        return None if shared else str(row["digest"])

    def active_jobs(self) -> list[JobRecord]:
        """Jobs that wait or run, oldest first."""
        with self._reading() as connection:
            rows = connection.execute(f"SELECT * FROM jobs WHERE {IS_ACTIVE} ORDER BY created_at_s, id").fetchall()
        return [job_of(row) for row in rows]

    def look_for_results(self, is_there: Callable[[str], bool], missing: Failure) -> list[str]:
        """Ids of the jobs whose result's files are not there any more; files that are there again make jobs whole.

        What the store knows of such a job stays, so that its files can come back. is_there: told a digest.
        """
        with self._transaction() as connection:
            rows = connection.execute("SELECT id, digest, status FROM jobs WHERE digest IS NOT NULL").fetchall()
            lost = [row["id"] for row in rows if row["status"] == JobStatus.SUCCEEDED and not is_there(row["digest"])]
            back = [row["id"] for row in rows if row["status"] != JobStatus.SUCCEEDED and is_there(row["digest"])]
            for status, failure, jobs in (
                (JobStatus.INTERRUPTED, failure_text(missing), lost),
                (JobStatus.SUCCEEDED, None, back),
            ):
                told = [(status, failure, job) for job in jobs]
                connection.executemany("UPDATE jobs SET status = ?, failure = ? WHERE id = ?", told)
        return lost

    def succeeded(self) -> list[tuple[str, str]]:
        """(job id, digest) of every job whose result is at hand."""
        with self._reading() as connection:
            rows = connection.execute(
                "SELECT id, digest FROM jobs WHERE status = ? AND digest IS NOT NULL", (JobStatus.SUCCEEDED,)
            ).fetchall()
        return [(row["id"], row["digest"]) for row in rows]

    def row(self, table: Literal["dems", "jobs"], id: str) -> StoredRow | None:
        """A DEM or a job as it is stored, for whoever keeps a note of it."""
        with self._reading() as connection:
            row = connection.execute(f"SELECT * FROM {table} WHERE id = ?", (id,)).fetchone()
        return None if row is None else dict(row)

    def known(self) -> Known:
        """Everything that the store knows."""
        with self._lock:
            self._check_in_place()
            return read_known(self._connection)

    def _reading(self) -> AbstractContextManager[sqlite3.Connection]:
        """A transaction that only reads; another program that writes does not hold it up."""
        return self._transaction("BEGIN")

    @contextmanager
    def transaction(self, begin: str = "BEGIN IMMEDIATE") -> Iterator[sqlite3.Connection]:
        """All or nothing, also for what others keep in the same file. "BEGIN" only reads."""
        with self._lock:
            self._check_in_place()
            self._connection.execute(begin)
            try:
                yield self._connection
                self._connection.execute("COMMIT")
            finally:
                # SQLite has rolled back by itself when the disk was full
                if self._connection.in_transaction:
                    self._connection.execute("ROLLBACK")

    _transaction = transaction

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

    def _prepare(self, path: Path) -> None:
        version_of(self._connection, path)
        # pages of two stores, where one was put back beside the other's write-ahead log, would be written on
        (told,) = self._connection.execute("PRAGMA quick_check(1)").fetchone()
        if told != "ok":
            raise DataFolderError(
                f"{path} is damaged ({' '.join(told.split())}) and left as it is; `sightline store restore` puts a "
                "backup in its place."
            )
        migrate(self._connection, path)
