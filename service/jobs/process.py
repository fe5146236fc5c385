"""One worker process as the service sees it: start it, give it a task, hear how it goes, kill it."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from pathlib import Path
from typing import Any, Self

from service.machine.limits import this_machine
from service.settings import Settings

from .channel import MAX_LINE_BYTES, FromWorker, Order, Start, Stop, ToWorker, decode, encode
from .records import Failure

__all__ = ["NeverBegan", "TaskFailed", "WorkerDied", "WorkerProcess", "to_its_end"]

PACKAGE_ROOT = Path(__file__).parents[2]


class TaskFailed(Exception):  # noqa: N818 - an outcome, told by the worker in good order
    """The task ended with a failure that has a sentence."""

    def __init__(self, failure: Failure) -> None:
        super().__init__(failure.detail)
        self.failure = failure


class WorkerDied(Exception):  # noqa: N818 - an outcome
    """The process ended before the task did; carries how, as its return code or in words."""

    def __init__(self, ended: int | str | None) -> None:
        if isinstance(ended, int) and ended < 0:
            ended = f"signal {-ended}"
        super().__init__(ended if isinstance(ended, str) else f"exit code {ended}")


class NeverBegan(WorkerDied):
    """It had ended before it took the task up, which is not to blame."""


class WorkerProcess:
    """A warm process that does one task at a time."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process

    @classmethod
    async def start(cls, settings: Settings, *, first: bool) -> Self:
        """Start a process and wait until it is warm; raises WorkerDied when it never gets there.

        first: whether it compiles what no worker before it has.
        """
        # -P: a folder named like one of our packages, where the service was started, must not be imported
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-P",
            "-m",
            "service.machine.following",
            str(os.getpid()),
            "service.jobs.worker",
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            limit=MAX_LINE_BYTES,
            # Ctrl-C in a terminal is for the service, which decides when its workers end
            start_new_session=True,
            env={**_threads(), **os.environ, "PYTHONPATH": os.pathsep.join(_import_path())},
        )
        worker = cls(process)
        try:
            await worker._say(Start(settings=settings.model_dump(mode="json"), first=first))
            await worker._hear()
        except BaseException:
            await worker.kill()
            raise
        return worker

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether it has not ended, as far as is known."""
        return self._process.returncode is None

    async def ended(self) -> None:
        """Wait until the process is no more."""
        await self._process.wait()

    async def do(
        self,
        order: Order,
        on_progress: Callable[[float], None] | None = None,
        on_begun: Callable[[], Awaitable[None]] | None = None,
    ) -> Mapping[str, object]:
        """Do one task; raises TaskFailed, WorkerDied and NeverBegan.

        When cancelled, the process is of no more use: kill it. on_begun: called as soon as the process is at it.
        """
        try:
            await self._say(order)
            await self._hear()  # that it has begun
        except WorkerDied as died:
            raise NeverBegan(str(died)) from died
        if on_begun is not None:
            await on_begun()
        while True:
            message = await self._hear()
            if "progress" in message:
                if on_progress is not None:
                    on_progress(message["progress"])
            elif "failure" in message:
                raise TaskFailed(Failure(**message["failure"]))
            elif "result" in message:
                return message["result"]

    async def ask_to_stop(self, token: str) -> None:
        """Ask the task of that work folder to end with what it has; raises WorkerDied."""
        await self._say(Stop(stop=token))

    async def kill(self) -> None:
        """End the process at once, and wait until the system has it back."""
        if self._process.returncode is None:
            try:
                self._process.kill()
            except ProcessLookupError:
                return
        await self._process.wait()

    async def _say(self, message: ToWorker) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(encode(message))
            await self._process.stdin.drain()
        except (ConnectionError, RuntimeError) as error:
            raise WorkerDied(await self._process.wait()) from error

    async def _hear(self) -> FromWorker:
        assert self._process.stdout is not None
        line = await self._process.stdout.readline()
        if not line.endswith(b"\n"):
            raise WorkerDied(await self._process.wait())
        message: FromWorker = decode(line)
        return message


def _threads() -> dict[str, str]:
    """Under a quota, no more threads than it can keep busy; libraries count the processors of the machine."""
    cores = this_machine().cores
    whole = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else cores
    return (
        {}
        if cores == whole
        else dict.fromkeys(("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), str(cores))
    )


def _import_path() -> list[str]:
    inherited = os.environ.get("PYTHONPATH", "")
    return [str(PACKAGE_ROOT), *(part for part in inherited.split(os.pathsep) if part)]


async def to_its_end(work: Coroutine[Any, Any, None]) -> None:
    """Wait for something that has to be finished even if we are cancelled."""
    task = asyncio.ensure_future(work)
    while not task.done():
        try:
            await asyncio.shield(task)
        except asyncio.CancelledError:
            continue
