"""The memory of the service: DEMs and jobs in a database, every change one transaction."""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Set
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Literal

from pydantic import JsonValue

from service.database import READ, TROUBLE, WRITE, Begin, Connection, Database, Place
from service.database.sqlite import SqliteDatabase
from service.errors import InUseError, NotFoundError

from .records import DemRecord, Failure, JobRecord, JobStatus, Known, as_json, dem_of, failure_text, job_of
from .sharing.tenants import own_id, salt_of, seen, spend
from .store_file import IS_ACTIVE, StoredRow, read_known

__all__ = ["TROUBLE", "Store"]

# of a job in a list: what was asked and what came out can be long, and there are many
SHORT = (
    "id, kind, dem_id, '{\"parameters\": {}}' AS request, status, created_at_s, started_at_s, finished_at_s, attempts, "
    "digest, NULL AS summary, failure, pinned, tenant"
)
AT_ONCE = 500
NEWEST = "ORDER BY created_at_s DESC, id LIMIT ? OFFSET ?"


class Store:
    """DEMs and jobs. Every method is one transaction and safe to call from any thread.

    where: the file of SQLite, or another database. Raises DataFolderError when it is not a store, of a newer version,
    or was removed since. sqlite3.DatabaseError passes through when the disk is full, or another program holds the
    file: ``error_of_store`` tells which.
    """

    def __init__(self, where: Path | Database) -> None:
        self._database = SqliteDatabase(where) if isinstance(where, Path) else where
        # by tenant and kind; nobody else writes while the service has the store
        self._counts: Counter[tuple[str, str]] | None = None
        self._changes_number = threading.Lock()

    def close(self) -> None:
        """Close the database."""
        self._database.close()

    def check_writable(self) -> None:
        """Raises what a write would."""
        self._database.check_writable()

    @property
    def size_bytes(self) -> int:
        """What the database takes."""
        return self._database.size_bytes

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

    def dems(self, limit: int, offset: int = 0, after: Place | None = None) -> tuple[list[DemRecord], int]:
        """One page, newest first, and how many there are in all. after: the last of the page before, if it is known."""
        mine, whose = seen()
        older, than = ("1 = 1", ()) if after is None else after.condition("created_at_s")
        with self._reading() as connection:
            total = connection.execute(f"SELECT count(*) FROM dems WHERE {mine}", whose).fetchone()[0]
            rows = connection.execute(
                f"SELECT * FROM dems WHERE {mine} AND {older} {NEWEST}", (*whose, *than, limit, offset)
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
        with self._changing_number() as connection:
            if connection.execute(of_the_job, (job.dem_id, job.tenant)).fetchone() is None:
                raise NotFoundError("DEM", job.dem_id)
            connection.execute(
                "INSERT INTO jobs (id, kind, dem_id, request, status, created_at_s, tenant) VALUES (?,?,?,?,?,?,?)",
                columns,
            )
            self._counted((job.tenant, job.kind), 1)

    def job(self, kind: str, job_id: str) -> JobRecord:
        """Raises NotFoundError."""
        mine, whose = seen()
        query = f"SELECT * FROM jobs WHERE id = ? AND kind = ? AND {mine}"
        with self._reading() as connection:
            row = connection.execute(query, (job_id, kind, *whose)).fetchone()
        if row is None:
            raise NotFoundError(kind, job_id)
        return job_of(row)

    def jobs(self, kind: str, limit: int, offset: int = 0, after: Place | None = None) -> tuple[list[JobRecord], int]:
        """One page, newest first, without what was asked and what came out, and how many there are in all.

        after: the last of the page before, where it is known; a page is then as quick however deep it lies.
        """
        mine, whose = seen()
        older, than = ("1 = 1", ()) if after is None else after.condition("created_at_s")
        total = self._count(kind)
        with self._reading() as connection:
            rows = connection.execute(
                f"SELECT {SHORT} FROM jobs WHERE {mine} AND kind = ? AND {older} {NEWEST}",
                (*whose, kind, *than, limit, offset),
            ).fetchall()
        return [job_of(row) for row in rows], total

    def _count(self, kind: str) -> int:
        counts = self._counts
        if counts is None:
            with self._changes_number, self._reading() as connection:
                rows = connection.execute("SELECT tenant, kind, count(*) FROM jobs GROUP BY tenant, kind").fetchall()
                self._counts = counts = Counter({(row[0], row[1]): row[2] for row in rows})
        _, whose = seen()
        if whose:
            return counts[whose[0], kind]
        return sum(number for (_, of), number in list(counts.items()) if of == kind)

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
                "UPDATE jobs SET status = ?, started_at_s = NULL, "
                "attempts = CASE WHEN attempts > 0 THEN attempts - ? ELSE 0 END WHERE id = ?",
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
        gone = "DELETE FROM jobs WHERE id = ? RETURNING digest, tenant, kind"
        with self._changing_number() as connection:
            row = connection.execute(gone, (job_id,)).fetchone()
            if row is None:
                return None
            self._counted((row["tenant"], row["kind"]), -1)
            if row["digest"] is None:
                return None
            shared = connection.execute("SELECT 1 FROM jobs WHERE digest = ?", (row["digest"],)).fetchone()
        return None if shared else str(row["digest"])

    def active_jobs(self) -> list[JobRecord]:
        """Jobs that wait or run, oldest first."""
        with self._reading() as connection:
            rows = connection.execute(f"SELECT * FROM jobs WHERE {IS_ACTIVE} ORDER BY created_at_s, id").fetchall()
        return [job_of(row) for row in rows]

    def look_for_results(self, known: Known, there: Set[str], missing: Failure) -> list[str]:
        """Ids of the jobs whose result's files are not there any more; files that are there again make jobs whole.

        What the store knows of such a job stays, so that its files can come back. there: digests.
        """
        with self._transaction() as connection:
            _put_right(connection, known.lost & there, JobStatus.SUCCEEDED, None)
            return _put_right(connection, known.whole - there, JobStatus.INTERRUPTED, failure_text(missing))

    def succeeded(self, after: str, limit: int) -> list[tuple[str, str]]:
        """(job id, digest) of jobs whose result is at hand, by id, those that follow on a job's."""
        query = "SELECT id, digest FROM jobs WHERE id > ? AND status = ? AND digest IS NOT NULL ORDER BY id LIMIT ?"
        with self._reading() as connection:
            rows = connection.execute(query, (after, JobStatus.SUCCEEDED, limit)).fetchall()
        return [(row["id"], row["digest"]) for row in rows]

    def row(self, table: Literal["dems", "jobs"], id: str) -> StoredRow | None:
        """A DEM or a job as it is stored, for whoever keeps a note of it."""
        with self._reading() as connection:
            row = connection.execute(f"SELECT * FROM {table} WHERE id = ?", (id,)).fetchone()
        return None if row is None else dict(row)

    def known(self) -> Known:
        """Everything that the store knows."""
        with self._reading() as connection:
            return read_known(connection)

    def transaction(self, begin: Begin = WRITE) -> AbstractContextManager[Connection]:
        """All or nothing, also for what others keep in the same database. "BEGIN" only reads."""
        return self._database.transaction(begin)

    _transaction = transaction

    @contextmanager
    def _changing_number(self) -> Iterator[Connection]:
        """A transaction that adds or removes jobs."""
        try:
            with self._changes_number, self._database.transaction() as connection:
                yield connection
        except BaseException:
            self._counts = None
            raise

    def _counted(self, whose: tuple[str, str], more: int) -> None:
        if self._counts is not None:
            self._counts[whose] += more

    def _reading(self) -> AbstractContextManager[Connection]:
        """A transaction that only reads; another program that writes does not hold it up."""
        return self._database.transaction(READ)


def _put_right(connection: Connection, digests: Set[str], status: JobStatus, failure: str | None) -> list[str]:
    """Ids of the jobs of these results which had another status."""
    changed, all_of_them = list[str](), sorted(digests)
    for first in range(0, len(all_of_them), AT_ONCE):
        some = all_of_them[first : first + AT_ONCE]
        these = f"digest IN ({', '.join('?' * len(some))}) AND status <> ?"
        update = f"UPDATE jobs SET status = ?, failure = ? WHERE {these} RETURNING id"
        changed += [row[0] for row in connection.execute(update, (status, failure, *some, status)).fetchall()]
    return changed
