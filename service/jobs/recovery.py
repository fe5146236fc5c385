"""What a start does with what the last process of ours left: nothing finished is lost, nothing begun is forgotten."""

from __future__ import annotations

import logging

from service.errors import JobInterruptedError

from .folder import DataFolder
from .notes import note_all
from .records import Failure, JobRecord, JobStatus
from .store import Store

__all__ = ["interrupted", "recover"]

logger = logging.getLogger("sightline.jobs")


def recover(store: Store, folder: DataFolder, max_attempts: int) -> list[JobRecord]:
    """Jobs to take on again: those that waited, and those that ran unless they were tried often enough."""
    known = store.known()
    folder.take_back(known)
    folder.set_aside_unknown(known)
    for dem_id in sorted(known.dems):
        if not folder.dem(dem_id).is_dir():
            logger.error("DEM %s: its files are missing from the data folder; upload it again", dem_id)
    again = []
    for job in store.active_jobs():
        if job.status is JobStatus.RUNNING and job.attempts >= max_attempts:
            store.finish_job(job.id, JobStatus.INTERRUPTED, failure=Failure.of(interrupted(job.attempts)))
        elif job.has_inputs and not folder.inputs(job.id).is_dir():
            store.finish_job(job.id, JobStatus.INTERRUPTED, failure=_missing("What it was asked"))
        else:
            if job.status is JobStatus.RUNNING:
                store.requeue_job(job.id)
            again.append(job)
    for job_id in store.look_for_results(lambda digest: folder.result(digest).is_dir(), _missing("Its result")):
        logger.error("job %s: its result is missing from the data folder", job_id)
    note_all(store, folder)
    held = folder.count_quarantined()
    if held:
        logger.warning("%d in quarantine, where nothing is deleted; `sightline store check` lists it", held)
    return again


def interrupted(attempts: int) -> JobInterruptedError:
    """A job's worker died in its last attempt."""
    times = "once" if attempts == 1 else f"{attempts} times"
    return JobInterruptedError(
        f"The job was started {times} and its worker process ended each time before it was done; it may need more "
        "memory than the machine has. POST it again to try once more."
    )


def _missing(what: str) -> Failure:
    return Failure("service.JobInterruptedError", f"{what} is missing from the data folder.")
