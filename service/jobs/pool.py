"""The pool of warm worker processes: lanes share them, spares stand by, dead ones are replaced."""

from __future__ import annotations

import asyncio
import logging
import uuid
from collections.abc import Awaitable, Callable, Mapping
from enum import Enum

from service.errors import JobInterruptedError, TimeLimitError
from service.machine.shares import share_of
from service.settings import Settings

from .channel import Order
from .cluster.here import Cluster
from .folder import DataFolder
from .process import NeverBegan, TaskFailed, WorkerDied, WorkerProcess
from .sharing.turns import Turns

__all__ = ["Lane", "WorkerPool"]

logger = logging.getLogger("sightline.pool")

FIRST_PAUSE_S = 0.2
LONGEST_PAUSE_S = 30.0
# Compiling every kernel on a slow machine takes some minutes; longer than this it hangs, or never starts.
START_MAY_TAKE_S = 900.0


class Lane(Enum):
    """Which queue a task waits in: long calculations must not hold up short tasks."""

    CALCULATIONS = "calculations"
    FILES = "files"
    CHECKS = "checks"  # of requests, by the processes of files and with less time
    PROBES = "probes"  # of single places, many a second, by the processes that stand by


# the settings that limit how long a task of each lane may take
SETTINGS = {
    Lane.CALCULATIONS: "SIGHTLINE_MAX_JOB_S",
    Lane.FILES: "SIGHTLINE_MAX_FILE_TASK_S",
    Lane.CHECKS: "SIGHTLINE_MAX_CHECK_S",
    Lane.PROBES: "SIGHTLINE_MAX_CHECK_S",
}


class WorkerPool:
    """Worker processes for the lanes, the spares among them: they probe, and step in when another is killed."""

    def __init__(self, settings: Settings, folder: DataFolder) -> None:
        self._settings = settings
        self._folder = folder
        here = settings.processes
        self._size = here.workers + here.file_workers + here.spare_workers
        self._cluster = Cluster(settings, folder) if settings.calculate_on == "cluster" else None
        files = Turns(settings.file_workers)
        self._lanes = {
            Lane.CALCULATIONS: Turns(settings.workers),
            Lane.FILES: files,
            Lane.CHECKS: files,
            Lane.PROBES: Turns(max(settings.spare_workers, 1)),
        }
        self._limits_s = {
            Lane.CALCULATIONS: settings.max_job_s,
            Lane.FILES: settings.max_file_task_s,
            Lane.CHECKS: settings.max_check_s,
            Lane.PROBES: settings.max_check_s,
        }
        self._waiting = dict.fromkeys(Lane, 0)
        self._idle: list[WorkerProcess] = []
        self._workers: set[WorkerProcess] = set()
        self._at_work: dict[str, WorkerProcess] = {}
        self._someone_idle = asyncio.Condition()
        self._keepers: list[asyncio.Task[None]] = []
        self._first_warm = asyncio.Event()

    def start(self) -> None:
        """Begin to start processes; tasks may be given at once and wait until the first is warm."""
        self._keepers = [asyncio.create_task(self._keep_one_alive(number)) for number in range(self._size)]

    async def stop(self) -> None:
        """Kill every process."""
        for keeper in self._keepers:
            keeper.cancel()
        await asyncio.gather(*self._keepers, return_exceptions=True)
        if self._cluster is not None:
            await self._cluster.close()

    async def until_warm(self) -> None:
        """Wait for the first process that is ready."""
        await self._first_warm.wait()

    @property
    def size(self) -> int:
        """Processes that there should be."""
        return self._size

    @property
    def warm(self) -> int:
        """Processes that are ready or at work."""
        return len(self._workers)

    @property
    def pids(self) -> list[int]:
        """Process ids of the warm processes."""
        return sorted(worker.pid for worker in self._workers)

    def waiting(self, lane: Lane) -> int:
        """Tasks that wait in a lane."""
        return self._waiting[lane]

    def waiting_of(self, client: str, lane: Lane) -> int:
        """Tasks that wait in a lane for that client."""
        return self._lanes[lane].waiting(client)

    async def run(
        self,
        lane: Lane,
        task: str,
        arguments: Mapping[str, object],
        *,
        token: str | None = None,
        salt: str = "",
        client: str = "",
        on_start: Callable[[], Awaitable[None]] | None = None,
        on_progress: Callable[[float], None] | None = None,
    ) -> Mapping[str, object]:
        """Do a task in a lane, one of each client after another; cancelling it kills the process that is at it.

        salt: of the tenant that it is for. client: with whom it takes turns.
        token: names the work folder; whoever gives one takes the folder over when all went well.
        on_start: called when a process is at it. Raises TaskFailed, WorkerDied, TimeLimitError, and
        JobInterruptedError when no process gets warm.
        """
        self._waiting[lane] += 1
        try:
            await self._lanes[lane].acquire(client)
        finally:
            self._waiting[lane] -= 1
        try:
            return await self._run_now(lane, task, arguments, token or uuid.uuid4().hex, salt, on_start, on_progress)
        finally:
            self._lanes[lane].release()

    async def ask_to_stop(self, token: str) -> bool:
        """Ask the task of that work folder to end with what it has; whether a process is at it."""
        if self._cluster is not None:
            return await self._cluster.ask_to_stop(token)
        worker = self._at_work.get(token)
        if worker is None:
            return False
        try:
            await worker.ask_to_stop(token)
        except WorkerDied:
            return False
        return True

    async def _run_now(
        self,
        lane: Lane,
        task: str,
        arguments: Mapping[str, object],
        token: str,
        salt: str,
        on_start: Callable[[], Awaitable[None]] | None,
        on_progress: Callable[[float], None] | None,
    ) -> Mapping[str, object]:
        memory_bytes = share_of(lane.value, self._settings.max_worker_memory_bytes)
        order = Order(task=task, token=token, salt=salt, memory_bytes=memory_bytes, arguments=dict(arguments))
        if lane is Lane.CALCULATIONS and self._cluster is not None:
            return await self._cluster.run(order, self._limits_s[lane], on_start, on_progress)
        for _ in range(self._size + 1):
            try:
                return await self._done_by(await self._take_idle(), lane, order, on_start, on_progress)
            except NeverBegan as died:  # it was killed while it stood by, and nobody had noticed yet
                logger.warning("task %s: a worker that stood by had ended with %s", task, died)
        raise WorkerDied("the loss of all that stood by")

    async def _done_by(
        self,
        worker: WorkerProcess,
        lane: Lane,
        order: Order,
        on_start: Callable[[], Awaitable[None]] | None,
        on_progress: Callable[[float], None] | None,
    ) -> Mapping[str, object]:
        token = order["token"]
        try:
            self._at_work[token] = worker
            async with asyncio.timeout(self._limits_s[lane]):
                result = await worker.do(order, on_progress, on_start)
        except TaskFailed:
            await self._give_back(worker)
            raise
        except BaseException as error:
            # its keeper notices and starts another
            await asyncio.shield(worker.kill())
            await asyncio.shield(asyncio.to_thread(self._folder.remove, self._folder.work(token)))
            if isinstance(error, TimeoutError):
                raise TimeLimitError(
                    f"The {order['task']} task took longer than {self._limits_s[lane]:g} s "
                    f"(setting {SETTINGS[lane]}); ask for less at once, or raise the limit."
                ) from error
            raise
        finally:
            self._at_work.pop(token, None)
        await self._give_back(worker)
        return result

    async def _take_idle(self) -> WorkerProcess:
        try:
            async with asyncio.timeout(START_MAY_TAKE_S), self._someone_idle:
                await self._someone_idle.wait_for(lambda: self._idle)
                # the one that worked last has its DEM still at hand
                return self._idle.pop()
        except TimeoutError as error:
            raise JobInterruptedError(
                f"No worker process could be started within {START_MAY_TAKE_S:g} s; the service's log tells why. POST "
                "it again when that is mended."
            ) from error

    async def _give_back(self, worker: WorkerProcess) -> None:
        async with self._someone_idle:
            if worker in self._workers:
                self._idle.append(worker)
                self._someone_idle.notify()

    async def _keep_one_alive(self, number: int) -> None:
        """Start a process, and another whenever it ends; pause longer and longer while they do not get warm."""
        pause_s = FIRST_PAUSE_S
        if number > 0:
            # on a fresh machine the first compiles the kernels, and the others find them compiled
            await self._first_warm.wait()
        while True:
            try:
                async with asyncio.timeout(START_MAY_TAKE_S):
                    worker = await WorkerProcess.start(self._settings, first=not self._first_warm.is_set())
            except (WorkerDied, OSError) as error:
                logger.error("a worker process could not be started (%r); next try in %.1f s", error, pause_s)
                await asyncio.sleep(pause_s)
                pause_s = min(2.0 * pause_s, LONGEST_PAUSE_S)
                continue
            pause_s = FIRST_PAUSE_S
            self._first_warm.set()
            try:
                self._workers.add(worker)
                await self._give_back(worker)
                await worker.ended()
            finally:
                self._workers.discard(worker)
                if worker in self._idle:
                    self._idle.remove(worker)
                await asyncio.shield(worker.kill())
