"""On a machine of a Dask cluster: a job done by a worker process as the service's own are, which a Dask worker watches.

The process has the memory limit, the niceness and the words of a local one; the Dask worker starts it, hands on what it
says, and ends it when nobody wants its job any more. All of this runs in the Dask worker's event loop.
"""

from __future__ import annotations

import asyncio
import uuid
from collections import defaultdict
from typing import Any, TypedDict, final

import orjson

from service.errors import ClusterSetUpError
from service.jobs.channel import FailureFields, Order
from service.jobs.folder import VERSION, DataFolder
from service.jobs.marker import MARKER
from service.jobs.process import TaskFailed, WorkerDied, WorkerProcess
from service.jobs.records import Failure
from service.machine.shares import LEAST_BYTES, WARM_BYTES
from service.settings import Settings

__all__ = ["Asked", "Over", "do_order", "stop_order"]

LOOK_EVERY_S = 0.25
WANTED = ("executing", "long-running")


@final
class Asked(TypedDict):
    """A job for a cluster. settings: of the service, as JSON. key: of the task. topic: where it is told how it goes."""

    settings: str
    order: Order
    limit_s: float
    key: str
    topic: str
    version: str


@final
class Over(TypedDict):
    """How it ended: one of result, failure, the words of a process that died, and too late. token: its work folder."""

    token: str
    result: dict[str, object] | None
    failure: FailureFields | None
    died: str | None
    late: bool


class _Processes:
    """Worker processes of one Dask worker: those that stand by, by settings, and those at work, by job."""

    def __init__(self) -> None:
        self.idle: defaultdict[str, list[WorkerProcess]] = defaultdict(list)
        self.at_work: dict[str, tuple[WorkerProcess, str]] = {}
        self.started = 0

    async def take(self, settings: str) -> WorkerProcess:
        """A warm one. Raises WorkerDied."""
        while self.idle[settings]:
            process = self.idle[settings].pop()
            if process.alive:
                return process
        # those of a service with other settings, or of one that was, make room
        for other in [key for key in self.idle if key != settings]:
            for process in self.idle.pop(other):
                await process.kill()
        self.started += 1
        return await WorkerProcess.start(Settings.model_validate(orjson.loads(settings)), first=self.started == 1)


# a Dask worker is a process of its own, and each call finds what the one before left
PROCESSES = _Processes()


async def do_order(asked: Asked) -> Over:
    """Do one job. It is told on the topic when it begins, with its work folder, and how far it is."""
    from distributed import get_worker

    dask, order, token = get_worker(), asked["order"], uuid.uuid4().hex
    dask.log_event(asked["topic"], {"key": asked["key"], "token": token, "where": dask.address})
    settings = Settings.model_validate(orjson.loads(asked["settings"]))
    over = Over(token=token, result=None, failure=None, died=None, late=False)
    refused = _refusal(settings, asked["version"], dask.address)
    if refused is not None:
        failure = Failure.of(refused)
        over["failure"] = {"error": failure.error, "detail": failure.detail, "data": dict(failure.data)}
        return over
    if _spreads_itself(order):
        _give_up_place(dask, asked["key"])
    folder, process = DataFolder(settings.data_folder), None
    kept = False
    try:
        process = await PROCESSES.take(asked["settings"])
        watch = asyncio.create_task(_end_when_unwanted(dask, asked["key"], process))
        PROCESSES.at_work[order["token"]] = process, token
        mine = Order(**{**order, "token": token, "memory_bytes": _memory_bytes(dask, order["memory_bytes"])})
        try:
            async with asyncio.timeout(asked["limit_s"]):
                over["result"] = dict(await process.do(mine, _teller(dask, asked)))
            kept = _is_wanted(dask, asked["key"])
        finally:
            watch.cancel()
            PROCESSES.at_work.pop(order["token"], None)
        PROCESSES.idle[asked["settings"]].append(process)
    except TaskFailed as failed:
        failure = failed.failure
        over["failure"] = {"error": failure.error, "detail": failure.detail, "data": dict(failure.data)}
        assert process is not None
        PROCESSES.idle[asked["settings"]].append(process)
    except WorkerDied as died:
        over["died"] = str(died)
    except TimeoutError:
        over["late"] = True
    finally:
        if process is not None and process not in PROCESSES.idle[asked["settings"]]:
            await asyncio.shield(process.kill())
        if not kept:
            await asyncio.shield(asyncio.to_thread(folder.remove, folder.work(token)))
    return over


async def stop_order(token: str) -> bool:
    """Ask the process that is at the job with that work folder to end with what it has; whether there is one here."""
    process, mine = PROCESSES.at_work.get(token, (None, ""))
    if process is None:
        return False
    try:
        await process.ask_to_stop(mine)
    except WorkerDied:
        return False
    return True


def _refusal(settings: Settings, version: str, where: str) -> ClusterSetUpError | None:
    if version != VERSION:
        return ClusterSetUpError(f"The Dask worker {where} has Sightline {VERSION}, and the service is {version}.")
    if not (settings.data_folder / MARKER).is_file():
        return ClusterSetUpError(
            f"The Dask worker {where} does not find the data folder at {settings.data_folder}; mount it there, under "
            "the same path as where the service runs."
        )
    return None


def _spreads_itself(order: Order) -> bool:
    """Whether the job hands out work of its own to the cluster, and waits for it."""
    arguments: Any = order["arguments"]
    return bool(arguments["parameters"].get("run_on", "here") != "here")


def _give_up_place(dask: Any, key: str) -> None:
    """Leave the Dask worker's place to what this job waits for; else all places might wait for one."""
    from distributed.worker_state_machine import SecedeEvent

    dask.handle_stimulus(SecedeEvent(key=key, compute_duration=0.0, stimulus_id=f"secede-{key}"))


def _memory_bytes(dask: Any, told_bytes: int) -> int:
    """What the Dask worker may take, shared by its threads, less a warm process; without a limit as told."""
    limit_bytes = dask.memory_manager.memory_limit
    if not limit_bytes:
        return told_bytes
    return max(LEAST_BYTES, int(limit_bytes) // int(dask.state.nthreads) - WARM_BYTES)


def _teller(dask: Any, asked: Asked) -> Any:
    return lambda share: dask.log_event(asked["topic"], {"key": asked["key"], "progress": share})


def _is_wanted(dask: Any, key: str) -> bool:
    task = dask.state.tasks.get(key)
    return task is not None and task.state in WANTED


async def _end_when_unwanted(dask: Any, key: str, process: WorkerProcess) -> None:
    """Kill the process once its task was cancelled, or the service that asked is gone."""
    while _is_wanted(dask, key):
        await asyncio.sleep(LOOK_EVERY_S)
    await process.kill()
