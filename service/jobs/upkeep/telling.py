"""When jobs begin and end: a line of the log each, and whoever counts them hears it."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass

from service.jobs.records import JobRecord, JobStatus

__all__ = ["JobOver", "Telling"]

logger = logging.getLogger("sightline.jobs")


@dataclass(frozen=True, slots=True)
class JobOver:
    """A job's end. at_s: when, seconds since 1970 UTC; ran_s: seconds that its last attempt ran, None: never begun."""

    job: JobRecord
    status: JobStatus
    at_s: float
    ran_s: float | None
    why: str | None


class Telling:
    """What the supervisor tells of its jobs; listeners are called in the event loop."""

    def __init__(self) -> None:
        self.listeners: list[Callable[[JobOver], None]] = []
        self._begun_at_s: dict[str, float] = {}

    def begun(self, job: JobRecord, attempt: int) -> None:
        """A worker is at it."""
        self._begun_at_s[job.id] = time.monotonic()
        logger.info("job begins", extra={"job": job.id, "kind": job.kind, "dem": job.dem_id, "attempt": attempt})

    def over(self, job: JobRecord, status: JobStatus, why: str | None = None) -> None:
        """It is over, and the store knows it."""
        begun_at_s = self._begun_at_s.pop(job.id, None)
        ran_s = None if begun_at_s is None else time.monotonic() - begun_at_s
        told: dict[str, object] = {"job": job.id, "kind": job.kind, "status": str(status)}
        told |= {} if ran_s is None else {"ran_s": round(ran_s, 3)}
        told |= {} if why is None else {"why": why}
        logger.info("job is over", extra=told)
        for listener in self.listeners:
            listener(JobOver(job, status, time.time(), ran_s, why))
