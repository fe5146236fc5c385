"""What the routes of every kind of job share: the state as an answer, waiting for it, deleting it."""

from __future__ import annotations

from typing import Any

from fastapi import Request, Response

from service.errors import NotReadyError
from service.http.answers import JobOut, moment
from service.jobs.records import JobRecord, JobStatus

from .context import Service
from .problems import FailedJob, problem_of

__all__ = ["after_waiting", "finished", "path_of", "state_of"]

RETRY_AFTER_S = 1


def path_of(service: Service, job: JobRecord) -> str:
    """Where the job is found."""
    return f"{service.products[job.kind].path}/{job.id}"


def state_of(service: Service, job: JobRecord) -> dict[str, Any]:
    """The fields of JobOut."""
    ran = job.started_at_s is not None and job.finished_at_s is not None
    fields = JobOut.model_construct(
        id=job.id,
        status=job.status,
        progress=service.supervisor.progress(job),
        dem_id=job.dem_id,
        created_at=moment(job.created_at_s),
        started_at=moment(job.started_at_s),
        finished_at=moment(job.finished_at_s),
        run_s=job.finished_at_s - job.started_at_s if ran else None,  # type: ignore[operator] # both are there
        attempts=job.attempts,
        problem=None if job.failure is None else problem_of(job.failure, path_of(service, job)),
        links={"self": path_of(service, job), "dem": f"/dems/{job.dem_id}"},
    )
    return dict(fields)


async def after_waiting(
    request: Request, response: Response, service: Service, job: JobRecord, wait_s: float | None
) -> JobRecord:
    """The job after the wait that the client wanted; sets status 201 or 202 and headers.

    Raises FailedJob when it is over and has no result.
    """
    if wait_s is not None:
        response.headers["Preference-Applied"] = f"wait={wait_s:g}"
        await service.supervisor.wait(job.id, wait_s)
        job = await service.supervisor.in_store(service.store.job, job.kind, job.id)
    response.headers["Location"] = path_of(service, job)
    if job.failure is not None:
        raise FailedJob(job.failure, path_of(service, job))
    if job.active:
        response.status_code = 202
        response.headers["Retry-After"] = str(RETRY_AFTER_S)
    return job


async def finished(service: Service, kind: str, job_id: str) -> JobRecord:
    """A job that has a result. Raises NotFoundError, NotReadyError."""
    job = await service.supervisor.in_store(service.store.job, kind, job_id)
    if job.status is not JobStatus.SUCCEEDED:
        raise NotReadyError(f"The job is {job.status}, so it has no result" + (" yet." if job.active else "."))
    return job
