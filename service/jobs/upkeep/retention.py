"""Which results are kept: by age and by size as the settings say, pinned ones for good."""

from __future__ import annotations

import asyncio
import logging
import sqlite3
import time
from collections.abc import Awaitable, Callable
from typing import Any

from service.database import READ, TROUBLE, Row
from service.jobs.folder import DataFolder, digest_of
from service.jobs.marker import Quarantine, size_bytes
from service.jobs.records import JobRecord, JobStatus
from service.jobs.recovery import NOTES, note_job, note_some, unnote_job
from service.jobs.store import Store
from service.settings import Settings

from .space import Space

__all__ = ["Retention"]

logger = logging.getLogger("sightline.retention")

# so few at a time, that others come to the store in between
BATCH = 10
SWEEP_EVERY_S = 10.0
CLEAR_EVERY_S = 3600.0
UNKNOWN_KEPT_S = 7 * 24 * 3600.0


class Retention:
    """Every method but ``keep_sweeping`` is work for the store thread, and short."""

    def __init__(self, settings: Settings, store: Store, folder: DataFolder) -> None:
        self._keep_s = settings.keep_results_s
        self._max_bytes = settings.max_results_bytes
        self._store = store
        self._folder = folder
        self._known_bytes: int | None = None
        self._measured_to = ""

    @property
    def results_bytes(self) -> int:
        """What results take, as far as they have been measured."""
        return self._known_bytes or 0

    async def keep_sweeping(self, in_store: Callable[..., Awaitable[Any]], space: Space) -> None:
        """Note what has no note, measure results and delete those whose time is over, a few at a time, on and on."""
        noted: str | None = ""
        look_at_s = 0.0
        while True:
            try:
                while noted is not None:
                    noted = await in_store(note_some, self._store, self._folder, noted)
                if time.monotonic() >= look_at_s:
                    look_at_s = time.monotonic() + CLEAR_EVERY_S
                    await in_store(space.freeing, self.clear_quarantine)
                while await in_store(self.measure) or await in_store(space.freeing, self.sweep):
                    await asyncio.sleep(0)
            except (sqlite3.DatabaseError, *TROUBLE) as error:
                logger.error("results are not swept (%s); next try in %g s", error, SWEEP_EVERY_S)
            await asyncio.sleep(SWEEP_EVERY_S)

    def expires_at_s(self, job: JobRecord) -> float | None:
        """When a job is deleted for its age, seconds since 1970 UTC; None when it is not."""
        if self._keep_s is None or job.pinned or job.finished_at_s is None:
            return None
        return job.finished_at_s + self._keep_s

    def pin(self, kind: str, job_id: str, pinned: bool) -> JobRecord:
        """Keep a job for good, or no longer. Raises NotFoundError."""
        self._store.job(kind, job_id)
        with self._store.transaction() as connection:
            connection.execute("UPDATE jobs SET pinned = ? WHERE id = ?", (int(pinned), job_id))
        job = self._store.job(kind, job_id)
        if job.digest is not None:
            note_job(self._store, self._folder, job_id, job.digest)
        return job

    def forget(self, job_id: str, digest: str | None) -> None:
        """Delete a job that is over, and the files of its result unless others share them."""
        freed = self._store.remove_job(job_id)
        if freed is not None:
            self.measure_again(freed)
            self._folder.remove(self._folder.result(freed))
        elif digest is not None:
            unnote_job(self._folder, job_id, digest)

    def measure_again(self, digest: str) -> None:
        """The files of a result are more than they were, or gone."""
        with self._store.transaction() as connection:
            row = connection.execute("DELETE FROM results WHERE digest = ? RETURNING bytes", (digest,)).fetchone()
        if row is not None and self._known_bytes is not None:
            self._known_bytes -= row["bytes"]

    def measure(self) -> int:
        """See how big some results are whose size is not known; how many those were. Sets ``results_bytes``."""
        found = self._rows(
            "SELECT DISTINCT digest FROM jobs WHERE status = ? AND digest > ? AND NOT EXISTS "
            "(SELECT 1 FROM results WHERE results.digest = jobs.digest) ORDER BY digest LIMIT ?",
            *(JobStatus.SUCCEEDED, self._measured_to, BATCH),
        )
        # the next look goes on from here, or begins anew
        self._measured_to = found[-1]["digest"] if found else ""
        sizes = [(row["digest"], size_bytes(self._folder.result(row["digest"]))) for row in found]
        with self._store.transaction() as connection:
            if self._known_bytes is None:
                total = connection.execute("SELECT coalesce(sum(bytes), 0) FROM results").fetchone()[0]
                self._known_bytes = int(total)
            connection.executemany("INSERT INTO results (digest, bytes) VALUES (?, ?)", sizes)
        self._known_bytes += sum(size for _, size in sizes)
        return len(sizes)

    def sweep(self) -> int:
        """Delete some jobs that are too old, or the oldest of results that take too much; how many it were."""
        return self._sweep_old() + self._sweep_heavy()

    def clear_quarantine(self, now_s: float | None = None) -> int:
        """Delete results that lie there for long and that no store ever knew; how many those were.

        They were put in place a moment before the service was killed, and their job has begun again since.
        """
        quarantine = Quarantine(self._folder.root)
        gone = 0
        for path in quarantine.put_there_before((time.time() if now_s is None else now_s) - UNKNOWN_KEPT_S):
            if path.parent.name == "results" and not any(path.glob(f"{NOTES}/*")) and digest_of(path) == path.name:
                self._folder.remove(path)
                logger.info("%s is deleted: no store knew it, and it lay in quarantine for a week", path)
                gone += 1
        if gone:
            quarantine.forget_empty()
        return gone

    def _sweep_old(self) -> int:
        if self._keep_s is None:
            return 0
        old = self._rows(
            "SELECT id, kind, digest FROM jobs WHERE finished_at_s < ? AND pinned = 0 ORDER BY finished_at_s LIMIT ?",
            *(time.time() - self._keep_s, BATCH),
        )
        for row in old:
            self.forget(row["id"], row["digest"])
            logger.info("%s %s is deleted: it was over more than %g s ago", row["kind"], row["id"], self._keep_s)
        return len(old)

    def _sweep_heavy(self) -> int:
        if self._max_bytes is None or self.results_bytes <= self._max_bytes:
            return 0
        oldest = self._rows(
            "SELECT id, kind, digest FROM jobs JOIN results USING (digest) WHERE finished_at_s IS NOT NULL "
            "AND digest NOT IN (SELECT digest FROM jobs WHERE pinned = 1 AND digest IS NOT NULL) "
            "ORDER BY finished_at_s LIMIT ?",
            BATCH,
        )
        gone = 0
        for row in oldest:
            if self.results_bytes <= self._max_bytes:
                break
            took_bytes = self.results_bytes
            self.forget(row["id"], row["digest"])
            logger.info(
                "%s %s is deleted: results took %d bytes, more than the %d of SIGHTLINE_MAX_RESULTS_BYTES",
                *(row["kind"], row["id"], took_bytes, self._max_bytes),
            )
            gone += 1
        return gone

    def _rows(self, query: str, *values: float | str) -> list[Row]:
        with self._store.transaction(READ) as connection:
            return connection.execute(query, values).fetchall()
