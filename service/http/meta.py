"""The service about itself: alive, ready, how busy, and what the `type` of a problem means."""

from __future__ import annotations

import time
from typing import Literal

from fastapi import APIRouter, Request
from pydantic import BaseModel, ConfigDict, Field

from service.errors import BusyError, NotFoundError

from .answers import ProblemType
from .context import ServiceDep
from .openapi import problem_responses
from .problems import METHOD, PROBLEMS

__all__ = ["Health", "JobCounts", "Ready", "WorkerCounts", "health_routes", "problem_routes"]


class WorkerCounts(BaseModel):
    """Worker processes."""

    warm: int = Field(description="Processes that are ready or at work.")
    wanted: int = Field(description="Processes that there should be.")


class JobCounts(BaseModel):
    """Calculations that are not finished."""

    queued: int = Field(description="Jobs that wait for a worker.")
    running: int = Field(description="Jobs that are being calculated.")


class Health(BaseModel):
    """The state of the service in one glance."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "status": "ok",
                    "version": "0.1.0",
                    "uptime_s": 3600.5,
                    "workers": {"warm": 5, "wanted": 5},
                    "jobs": {"queued": 0, "running": 2},
                    "store_writable": True,
                    "quarantined": 0,
                }
            ]
        }
    )

    status: Literal["ok", "degraded"] = Field(description="degraded: no warm worker, or nothing can be written.")
    version: str = Field(description="Version of Sightline.")
    uptime_s: float = Field(description="Seconds since it started.")
    workers: WorkerCounts
    jobs: JobCounts
    store_writable: bool = Field(description="Whether data folder and job store could be written when last tried.")
    quarantined: int = Field(
        description="Number of DEMs, results and other things in the data folder's quarantine: the store did not know "
        "them. They stay there until somebody takes them back or clears it."
    )


class Ready(BaseModel):
    """Work can be given."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"status": "ready"}]})

    status: Literal["ready"] = Field(description="Always ready; otherwise the answer is 503.")


health_routes = APIRouter(tags=["Health"])


@health_routes.get("/health", summary="Is it alive?", responses=problem_responses())
async def health(request: Request, service: ServiceDep) -> Health:
    """Always 200 while the process answers; `degraded` when workers are missing or the data folder cannot be
    written."""
    pool, supervisor = service.pool, service.supervisor
    well = service.store_writable and pool.warm > 0
    return Health(
        status="ok" if well else "degraded",
        version=request.app.version,
        uptime_s=time.monotonic() - service.started_at_s,
        workers=WorkerCounts(warm=pool.warm, wanted=pool.size),
        jobs=JobCounts(queued=supervisor.queued, running=supervisor.running),
        store_writable=service.store_writable,
        quarantined=service.quarantined,
    )


@health_routes.get("/ready", summary="Can it take work?", responses=problem_responses(503))
async def ready(service: ServiceDep) -> Ready:
    """200 when a worker is warm and the job store can be written, 503 until then."""
    if not service.pool.warm:
        raise BusyError("No worker process is warm yet", limit_name="workers", limit=service.settings.workers)
    if not service.store_writable:
        raise BusyError("The job store cannot be written", limit_name="data_folder", limit=0)
    return Ready(status="ready")


problem_routes = APIRouter(prefix="/problems", tags=["Problems"])
DOCUMENTED = [*((kind, error.__doc__) for error, kind in PROBLEMS.items()), (METHOD, "Another method is needed.")]
TYPES = {
    kind.name: ProblemType(
        type=f"/problems/{kind.name}", title=kind.title, status=kind.status, description=(words or kind.title).strip()
    )
    for kind, words in DOCUMENTED
}


@problem_routes.get("", summary="List the kinds of problems", responses=problem_responses())
async def list_problem_types() -> list[ProblemType]:
    """Every `type` that a problem may have."""
    return [TYPES[name] for name in sorted(TYPES)]


@problem_routes.get("/{name}", summary="Look up a kind of problem", responses=problem_responses(404))
async def get_problem_type(name: str) -> ProblemType:
    """What a `type` means; it is the path of this very answer."""
    if name not in TYPES:
        raise NotFoundError("kind of problem", name)
    return TYPES[name]
