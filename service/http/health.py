"""How the service is: alive, ready for work, how busy, and what it may take of its machine."""

from __future__ import annotations

import time
from typing import Literal

from fastapi import APIRouter, Request
from pydantic import BaseModel, ConfigDict, Field

from service.access.callers import CALLER, Scope
from service.errors import BusyError
from service.jobs.pool import Lane, WorkerPool
from service.jobs.supervisor import Supervisor
from service.machine.limits import Machine, this_machine
from service.machine.shares import budget_bytes, share_of
from service.settings import Settings

from .context import ServiceDep
from .meta import problem_responses

__all__ = ["router", "sentence_of_memory"]

router = APIRouter(tags=["Health"])
MIB = 1024 * 1024


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


class Live(BaseModel):
    """The process answers."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"status": "alive"}]})

    status: Literal["alive"] = Field(description="Always alive; a process that is not does not answer.")


class Memory(BaseModel):
    """What the service plans to take at most, and of how much."""

    available_bytes: int = Field(description="What all its processes together may take.")
    set_by: Literal["control group", "machine"] = Field(description="Whose limit that is.")
    calculation_bytes: int = Field(description="What one calculation may take on top of a warm worker.")
    short_task_bytes: int = Field(description="The same of reading a DEM, checking a request, drawing a layer.")
    probe_bytes: int = Field(description="The same of a probe.")
    most_bytes: int = Field(description="What all processes take at most, each at its heaviest task.")
    fits: bool = Field(
        description="Whether that is less than the service may plan with: all of a control group, three quarters of a "
        "machine."
    )


class Storage(BaseModel):
    """What is kept, and for how long."""

    free_bytes: int = Field(description="What is left on the disk of the data folder.")
    min_free_bytes: int = Field(description="Below that, new work is refused.")
    results_bytes: int = Field(description="What results take.")
    max_results_bytes: int | None = Field(description="Beyond that, the oldest that are not pinned are deleted.")
    keep_results_s: float | None = Field(description="Results that are not pinned are kept so long; null: for good.")


class About(BaseModel):
    """What this service is made of."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "version": "0.1.0",
                    "cores": 1,
                    "workers": 1,
                    "file_workers": 1,
                    "spare_workers": 0,
                    "memory": {
                        "available_bytes": 1499996160,
                        "set_by": "control group",
                        "calculation_bytes": 320000000,
                        "short_task_bytes": 160000000,
                        "probe_bytes": 80000000,
                        "most_bytes": 1499524096,
                        "fits": True,
                    },
                    "storage": {
                        "free_bytes": 50000000000,
                        "min_free_bytes": 268435456,
                        "results_bytes": 2000000000,
                        "max_results_bytes": 20000000000,
                        "keep_results_s": 2592000.0,
                    },
                    "limits": {"max_anchors": 64, "max_job_s": 900.0},
                }
            ]
        }
    )

    version: str = Field(description="Version of Sightline.")
    cores: int = Field(description="Number of processors that it may keep busy, by its affinity and its quota.")
    workers: int = Field(description="Number of calculations that run at the same time.")
    file_workers: int = Field(description="Number of short tasks that run beside them.")
    spare_workers: int = Field(description="Number of processes that stand by and answer probes.")
    memory: Memory
    storage: Storage
    limits: dict[str, float] = Field(description="Every limit by the name of its setting.")


def memory_of(settings: Settings, machine: Machine) -> Memory:
    """What a service with these settings takes of the machine."""
    one = settings.max_worker_memory_bytes
    most = settings.processes.most_bytes(one)
    return Memory(
        available_bytes=machine.memory_bytes,
        set_by="control group" if machine.limited else "machine",
        calculation_bytes=one,
        short_task_bytes=share_of("files", one),
        probe_bytes=share_of("probes", one),
        most_bytes=most,
        fits=most <= budget_bytes(machine),
    )


def sentence_of_memory(settings: Settings, machine: Machine) -> tuple[bool, str]:
    """Whether it fits, and what an operator is told at the start."""
    memory = memory_of(settings, machine)
    told = (
        f"{memory.available_bytes / MIB:,.0f} MiB of memory ({memory.set_by}), {machine.cores} "
        f"core{'s' if machine.cores > 1 else ''}; {settings.processes.workers} x "
        f"{memory.calculation_bytes / MIB:,.0f} MiB for calculations, {settings.file_workers} x "
        f"{memory.short_task_bytes / MIB:,.0f} MiB for short tasks, all "
        f"processes at most {memory.most_bytes / MIB:,.0f} MiB"
    )
    if not memory.fits:
        told += (
            ", which is more than there is: give more memory, or lower SIGHTLINE_WORKERS, SIGHTLINE_FILE_WORKERS, "
            "SIGHTLINE_SPARE_WORKERS or SIGHTLINE_MAX_WORKER_MEMORY_BYTES"
        )
    if machine.killed_together:
        told += (
            "; memory.oom.group is 1, so that the kernel ends the service with a worker that is out of memory: set it "
            "to 0 (singleProcessOOMKill of a kubelet)"
        )
    return memory.fits and not machine.killed_together, told


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
        jobs=_jobs_seen(supervisor, pool),
        store_writable=service.store_writable,
        quarantined=service.quarantined,
    )


def _jobs_seen(supervisor: Supervisor, pool: WorkerPool) -> JobCounts:
    """All of them for who runs the service; else the tenant's own, for those of others are not its business."""
    caller = CALLER.get()
    if caller is None or caller.may(Scope.ADMIN):
        return JobCounts(queued=supervisor.queued, running=supervisor.running)
    queued = pool.waiting_of(caller.tenant, Lane.CALCULATIONS)
    return JobCounts(queued=queued, running=supervisor.unfinished_of(caller.tenant) - queued)


@router.get("/ready", summary="Can it take work?", responses=problem_responses(503))
async def ready(service: ServiceDep) -> Ready:
    """200 when service and a worker are warm, the job store can be written and the disk has room, 503 until then."""
    if not (service.warm and service.pool.warm):
        raise BusyError("No worker process is warm yet", limit_name="workers", limit=service.settings.workers)
    if not service.store_writable:
        raise BusyError("The job store cannot be written", limit_name="data_folder", limit=0)
    space = service.supervisor.space
    if space.low:
        raise BusyError("The disk is nearly full", limit_name="min_free_bytes", limit=space.least_bytes)
    return Ready(status="ready")


@router.get("/live", summary="Does it answer?", responses=problem_responses())
async def live() -> Live:
    """200 while the process answers, whatever else is wrong: for whoever restarts it when it does not."""
    return Live(status="alive")


@router.get("/about", summary="What may it take?", responses=problem_responses())
async def about(request: Request, service: ServiceDep) -> About:
    """Version, processes, memory, and every limit that requests meet."""
    settings, machine = service.settings, this_machine()
    told = settings.model_dump()
    limits = {name: told[name] for name in told if name.startswith("max_") and told[name] is not None}
    return About(
        version=request.app.version,
        cores=machine.cores,
        workers=settings.workers,
        file_workers=settings.file_workers,
        spare_workers=settings.spare_workers,
        memory=memory_of(settings, machine),
        storage=Storage(
            free_bytes=service.supervisor.space.free_bytes,
            min_free_bytes=service.supervisor.space.least_bytes,
            results_bytes=service.supervisor.retention.results_bytes,
            max_results_bytes=settings.max_results_bytes,
            keep_results_s=settings.keep_results_s,
        ),
        limits=limits,
    )
