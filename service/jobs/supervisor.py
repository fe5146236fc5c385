"""The supervisor: takes jobs in, gets them calculated, keeps the store true, and lets them be cancelled."""

from __future__ import annotations

import asyncio
import logging
import time
import uuid
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from functools import partial
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

from planning import PlanningProcessError
from service.access.callers import DEFAULT_TENANT, acting_client, acting_tenant
from service.database import TROUBLE
from service.errors import (
    InternalError,
    JobCancelledError,
    JobInterruptedError,
    NotReadyError,
    ServiceError,
)
from service.settings import Settings

from .channel import CalculateArguments, Calculated
from .folder import DataFolder, move_into_place
from .pool import Lane, WorkerPool
from .process import TaskFailed, WorkerDied, to_its_end
from .records import Failure, JobRecord, JobRequest, JobStatus
from .recovery import interrupted, note_job, recover
from .sharing.quotas import Quotas
from .store import Store
from .upkeep.retention import Retention
from .upkeep.space import Space
from .upkeep.telling import Telling

__all__ = ["Supervisor"]

logger = logging.getLogger("sightline.jobs")

CANCELLED = "The job was cancelled before it was finished."
PLANNER_DIED = Failure.of(PlanningProcessError("")).error  # a process of its own, as a worker is
STORE_RETRY_S = 1.0
P = ParamSpec("P")
R = TypeVar("R")


class Supervisor:
    """Every job that waits or runs is one asyncio task here; the store says the same, and outlives us."""

    def __init__(self, settings: Settings, folder: DataFolder, store: Store, pool: WorkerPool) -> None:
        self._settings = settings
        self._folder = folder
        self._store = store
        self._pool = pool
        self.space = Space(folder.root, settings.min_free_bytes)
        self.retention = Retention(settings, store, folder)
        self.telling = Telling()
        # one thread: what touches store and files happens in one order, and never in the event loop
        self._store_thread = ThreadPoolExecutor(1, thread_name_prefix="store")
        self._running: dict[str, asyncio.Task[None]] = {}
        self._progress: dict[str, float] = {}
        self.quotas = Quotas(settings, store)
        self._tenants: dict[str, str] = {}
        self._salts: dict[str, str] = {DEFAULT_TENANT: ""}
        self._admitting = 0
        self._stopping = False
        self.leaving = asyncio.Event()

    async def start(self) -> None:
        """Tidy up after a process that was killed, and take on again what it had not finished."""
        for job in await self.in_store(recover, self._store, self._folder, self._settings.max_attempts):
            self._begin(job)

    async def stop(self) -> None:
        """Leave everything unfinished for the next start; a job that runs is not blamed for it."""
        self._stopping = True
        for task in self._running.values():
            task.cancel()
        await asyncio.gather(*self._running.values(), return_exceptions=True)
        self._store_thread.shutdown()

    @property
    def queued(self) -> int:
        """Jobs that wait for a worker."""
        return self._pool.waiting(Lane.CALCULATIONS)

    @property
    def running(self) -> int:
        """Jobs that are being calculated."""
        return len(self._running) - self.queued

    def unfinished_of(self, tenant: str) -> int:
        """Jobs of a tenant that wait or run."""
        return sum(one == tenant for one in self._tenants.values())

    def progress(self, job: JobRecord) -> float:
        """Finished share of a job, 0..1."""
        if job.status is JobStatus.SUCCEEDED:
            return 1.0
        return self._progress.get(job.id, 0.0)

    async def in_store(self, work: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Do something with store or files, after all that was asked for before; it is done even if cancelled."""
        loop, context = asyncio.get_running_loop(), copy_context()  # whose request it is decides what is seen
        todo = partial(context.run, work, *args, **kwargs)
        return await asyncio.shield(loop.run_in_executor(self._store_thread, todo))

    async def ask(
        self,
        task: str,
        arguments: Mapping[str, object],
        token: str | None = None,
        lane: Lane = Lane.FILES,
        on_progress: Callable[[float], None] | None = None,
    ) -> Mapping[str, object]:
        """Have a task done beside the jobs, once more if its worker dies; a long one waits with the calculations.

        Raises BusyError, TaskFailed, TimeLimitError, JobInterruptedError.
        """
        self.refuse_requests(lane)
        salt, client = await self._salt(acting_tenant()), acting_client()
        for _ in range(self._settings.max_attempts):
            try:
                return await self._pool.run(
                    lane, task, arguments, token=token, salt=salt, client=client, on_progress=on_progress
                )
            except WorkerDied as died:
                logger.warning("task %s: its worker ended with %s", task, died)
        raise interrupted(self._settings.max_attempts)

    def refuse_requests(self, lane: Lane) -> None:
        """Raises BusyError, TooManyError where too many tasks wait, of all or of the client."""
        waiting = sum(self._pool.waiting(one) for one in {Lane.FILES, Lane.CHECKS, Lane.PROBES, lane})
        self.quotas.refuse_when_busy(waiting, "requests")
        self.quotas.refuse_waiting(self._pool.waiting_of(acting_client(), lane), "requests")

    async def submit(self, kind: str, dem_id: str, request: JobRequest, inputs: Path | None = None) -> JobRecord:
        """Take in a job; inputs: its folder. Raises LimitError, NotFoundError, DataFolderError, StorageFullError."""
        self.space.refuse_when_low()
        self.quotas.refuse_when_busy(len(self._running) + self._admitting - self._settings.workers, "jobs")
        self.quotas.refuse_waiting(self.unfinished_of(acting_tenant()), "jobs")
        job = JobRecord(uuid.uuid4().hex, kind, dem_id, request, JobStatus.QUEUED, time.time(), tenant=acting_tenant())
        self._admitting += 1
        try:
            if inputs is not None:
                await self.in_store(move_into_place, inputs, self._folder.inputs(job.id))
            await self.in_store(self._admit, job)
            self._begin(job)
        finally:
            self._admitting -= 1
        return job

    async def wait(self, job_id: str, seconds: float) -> None:
        """Come back when the job is over, after so many seconds, or when the service ends (``leaving``)."""
        task = self._running.get(job_id)
        if task is not None:
            leaving = asyncio.ensure_future(self.leaving.wait())
            await asyncio.wait({task, leaving}, timeout=seconds, return_when=asyncio.FIRST_COMPLETED)
            leaving.cancel()

    async def remove(self, kind: str, job_id: str, *, forget: bool = False) -> JobRecord | None:
        """Cancel a job that waits or runs (it comes back, cancelled), or forget a finished one and free its files.

        One that is cancelled already comes back as it is, unless it is to be forgotten. Raises NotFoundError.
        """
        job = await self.in_store(self._store.job, kind, job_id)
        task = self._running.get(job_id)
        if task is not None and job.active:
            task.cancel()
            await asyncio.wait({task})
            job = await self.in_store(self._store.job, kind, job_id)
            if job.active:  # cancelled before it took its first step
                await self._over(job, JobStatus.CANCELLED, JobCancelledError(CANCELLED))
                job = await self.in_store(self._store.job, kind, job_id)
        if job.status is JobStatus.CANCELLED and not forget:
            return job
        await self.in_store(self.space.freeing, self.retention.forget, job.id, job.digest)
        return None

    async def finish_early(self, kind: str, job_id: str) -> JobRecord:
        """Ask a job that runs to end with the best that it has so far; it is over soon after.

        Raises NotFoundError, NotReadyError (it waits, or is over).
        """
        job = await self.in_store(self._store.job, kind, job_id)
        if not await self._pool.ask_to_stop(job_id):
            raise NotReadyError(
                f"The job is {job.status}; only one that runs can end with what it has."
                + (" DELETE cancels it." if job.active else "")
            )
        return job

    async def _salt(self, tenant: str) -> str:
        if tenant not in self._salts:
            self._salts[tenant] = await self.in_store(self._store.salt, tenant)
        return self._salts[tenant]

    def _begin(self, job: JobRecord) -> None:
        task = asyncio.create_task(self._see_through(job))
        self._running[job.id], self._tenants[job.id] = task, job.tenant
        task.add_done_callback(
            lambda _: [of.pop(job.id, None) for of in (self._running, self._progress, self._tenants)]
        )

    async def _see_through(self, job: JobRecord) -> None:
        """Get one job done, whatever happens to its worker."""
        # the work folder is called as the job: whoever knows the job can reach the process that is at it
        attempts, token = job.attempts, job.id

        async def on_start() -> None:
            nonlocal attempts
            attempts += 1
            await self._surely(self._store.start_job, job.id)
            self.telling.begun(job, attempts)

        try:
            salt, client = await self._salt(job.tenant), acting_client() or job.tenant
            while True:
                try:
                    result = await self._pool.run(
                        Lane.CALCULATIONS,
                        job.kind,
                        CalculateArguments(dem_id=job.dem_id, job_id=job.id, **job.request),
                        token=token,
                        salt=salt,
                        client=client,
                        on_start=on_start,
                        on_progress=lambda share: self._progress.__setitem__(job.id, share),
                    )
                    break
                except (WorkerDied, TaskFailed) as died:
                    if isinstance(died, TaskFailed) and died.failure.error != PLANNER_DIED:
                        raise
                    logger.warning("job %s: its worker ended with %s in attempt %d", job.id, died, attempts)
                    if attempts >= self._settings.max_attempts:
                        await self._over(job, JobStatus.INTERRUPTED, interrupted(attempts))
                        return
                    await self._surely(self._store.requeue_job, job.id)
        except TaskFailed as failed:
            await self._over(job, JobStatus.FAILED, failed.failure)
        except JobInterruptedError as error:
            await self._over(job, JobStatus.INTERRUPTED, error)
        except ServiceError as error:
            await self._over(job, JobStatus.FAILED, error)
        except asyncio.CancelledError:
            if not self._stopping:
                await self._over(job, JobStatus.CANCELLED, JobCancelledError(CANCELLED))
            elif attempts > job.attempts:
                await self._surely(self._store.requeue_job, job.id, forget_attempt=True)
        except Exception:
            reference = uuid.uuid4().hex[:12]
            logger.exception("%s: job %s failed", reference, job.id)
            await self._over(job, JobStatus.FAILED, InternalError(reference))
        else:
            # a result is a result, also when it is cancelled this very moment
            await to_its_end(self._surely(self._keep, job.id, token, cast(Calculated, result)))
            self.telling.over(job, JobStatus.SUCCEEDED)

    async def _over(self, job: JobRecord, status: JobStatus, why: Failure | ServiceError) -> None:
        failure = Failure.of(why) if isinstance(why, ServiceError) else why
        await self._surely(self._end, job.id, status, failure)
        self.telling.over(job, status, failure.detail)

    async def _surely(self, work: Callable[P, Any], *args: P.args, **kwargs: P.kwargs) -> None:
        """Write to the store, again and again while the disk is full or away: no outcome is lost for want of space."""
        while True:
            try:
                await self.in_store(work, *args, **kwargs)
            except TROUBLE as error:
                if self._stopping:
                    raise
                logger.error("the job store cannot be written (%s); next try in %g s", error, STORE_RETRY_S)
                await asyncio.sleep(STORE_RETRY_S)
            else:
                return

    # -- what follows runs in the store thread

    def _admit(self, job: JobRecord) -> None:
        # an open database is written without an error even where its file was deleted
        self._folder.check_usable()
        self.quotas.refuse_work()
        self._store.add_job(job)

    def _keep(self, job_id: str, token: str, result: Calculated) -> None:
        work = self._folder.work(token)
        if work.exists():
            move_into_place(work, self._folder.result(result["digest"]))
        self._store.finish_job(job_id, JobStatus.SUCCEEDED, digest=result["digest"], summary=result["summary"])
        note_job(self._store, self._folder, job_id, result["digest"])
        self._folder.remove(self._folder.inputs(job_id))

    def _end(self, job_id: str, status: JobStatus, failure: Failure) -> None:
        self._store.finish_job(job_id, status, failure=failure)
        self._folder.remove(self._folder.inputs(job_id))
