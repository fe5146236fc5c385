"""How the service is: alive, ready, how busy."""

from __future__ import annotations

import time

from fastapi import APIRouter, Request

from service.errors import BusyError
from service.http.context import ServiceDep
from service.http.documented import problem_responses
from service.http.health_answer import Health, JobCounts, Ready, WorkerCounts

__all__ = ["router"]

router = APIRouter(tags=["Health"])


@router.get("/health", summary="Is it alive?", responses=problem_responses())
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


@router.get("/ready", summary="Can it take work?", responses=problem_responses(503))
async def ready(service: ServiceDep) -> Ready:
    """200 when a worker is warm and the job store can be written, 503 until then."""
    if not service.pool.warm:
        raise BusyError("No worker process is warm yet", limit_name="workers", limit=service.settings.workers)
    if not service.store_writable:
        raise BusyError("The job store cannot be written", limit_name="data_folder", limit=0)
    return Ready(status="ready")
