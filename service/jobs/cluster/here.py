"""Where the service runs: jobs handed to a Dask cluster, heard of, ended, and handed out again where it was lost."""

from __future__ import annotations

import asyncio
import concurrent.futures
import logging
import uuid
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, cast

import orjson

from service.errors import TimeLimitError
from service.jobs.channel import Order
from service.jobs.folder import VERSION, DataFolder, move_into_place
from service.jobs.process import TaskFailed, WorkerDied
from service.jobs.records import Failure
from service.settings import Settings

from .there import Asked, Over, do_order, stop_order

__all__ = ["Cluster"]

logger = logging.getLogger("sightline.cluster")

ANSWERS_WITHIN_S = 10.0
FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 30.0


class _ClusterLost(Exception):  # noqa: N818 - an outcome
    """The scheduler went away with what it knew."""


class Cluster:
    """A Dask cluster whose workers see the data folder under the path that it has here."""

    def __init__(self, settings: Settings, folder: DataFolder) -> None:
        self._address = str(settings.dask_scheduler)
        self._folder = folder
        self._settings = orjson.dumps(settings.model_dump(mode="json")).decode()
        self._topic = f"sightline-{uuid.uuid4().hex}"
        self._heard: dict[str, asyncio.Queue[Mapping[str, Any]]] = {}
        self._client: Any = None
        self._connecting = asyncio.Lock()

    async def close(self) -> None:
        """Leave the cluster, which ends what it still does for us."""
        if self._client is not None:
            await self._client.close()

    async def run(
        self,
        order: Order,
        limit_s: float,
        on_start: Callable[[], Awaitable[None]] | None,
        on_progress: Callable[[float], None] | None,
    ) -> Mapping[str, object]:
        """Do a job somewhere on the cluster; cancelling it ends the process that is at it.

        A scheduler that went away is waited for, and the job handed out anew. Raises TaskFailed, TimeLimitError, and
        WorkerDied when the process or its machine was lost.
        """
        attempt = _Attempt(self._folder, on_start, on_progress)
        try:
            while True:
                client = await self._connected()
                try:
                    return _told(await self._hand_out(client, order, limit_s, attempt), limit_s, order, attempt)
                except _ClusterLost as lost:
                    logger.warning(
                        "the cluster at %s was lost (%s); %s waits for it", self._address, lost, order["token"]
                    )
                    await self._disconnect(client)
        finally:
            await asyncio.shield(asyncio.to_thread(attempt.remove_what_is_left))

    async def ask_to_stop(self, token: str) -> bool:
        """Ask the job of that work folder to end with what it has; whether a process is at it."""
        if self._client is None:
            return False
        return any((await self._client.run(stop_order, token, on_error="ignore")).values())

    async def _hand_out(self, client: Any, order: Order, limit_s: float, attempt: _Attempt) -> Over:
        """How the job ended. Raises WorkerDied, _ClusterLost."""
        key = f"sightline-{uuid.uuid4().hex}"
        asked = Asked(
            settings=self._settings, order=order, limit_s=limit_s, key=key, topic=self._topic, version=VERSION
        )
        heard = self._heard[key] = asyncio.Queue()
        # impure: a job of the same words is done anew, since its files may be gone
        future = client.submit(do_order, asked, key=key, pure=False)
        over = asyncio.ensure_future(_outcome(future))
        begun = 0
        try:
            while not (over.done() and heard.empty()):
                hearing = asyncio.ensure_future(heard.get())
                await asyncio.wait({hearing, over}, return_when=asyncio.FIRST_COMPLETED)
                if not hearing.done():
                    hearing.cancel()
                    continue
                told = hearing.result()
                if "token" in told:
                    begun += 1
                    if begun > 1:
                        raise WorkerDied("the loss of its Dask worker")
                    await attempt.begin(told["token"], told["where"])
                else:
                    attempt.tell(told["progress"])
            return over.result()
        finally:
            del self._heard[key]
            if not over.done():
                over.cancel()
                await asyncio.shield(future.cancel())
            future.release()

    async def _connected(self) -> Any:
        """A client, as soon as a scheduler answers."""
        from distributed import Client

        pause_s = FIRST_PAUSE_S
        async with self._connecting:
            while self._client is None:
                client = Client(self._address, asynchronous=True, timeout=ANSWERS_WITHIN_S, set_as_default=False)
                try:
                    await client
                except (OSError, TimeoutError, ValueError) as error:
                    logger.error(
                        "no Dask scheduler answers at %s (%s); next try in %g s", self._address, error, pause_s
                    )
                    await client.close(timeout=1.0)
                    await asyncio.sleep(pause_s)
                    pause_s = min(2.0 * pause_s, LONGEST_PAUSE_S)
                    continue
                client.subscribe_topic(self._topic, self._hear)
                self._client = client
            return self._client

    async def _disconnect(self, client: Any) -> None:
        """Let go of a client whose scheduler is gone, unless somebody else has."""
        async with self._connecting:
            if self._client is client:
                self._client = None
                await client.close(timeout=1.0)

    def _hear(self, event: tuple[float, Mapping[str, Any]]) -> None:
        _, told = event
        heard = self._heard.get(told["key"])
        if heard is not None:
            heard.put_nowait(told)


class _Attempt:
    """One attempt at a job: told once that it began, and every folder that was begun for it."""

    def __init__(
        self,
        folder: DataFolder,
        on_start: Callable[[], Awaitable[None]] | None,
        on_progress: Callable[[float], None] | None,
    ) -> None:
        self._folder = folder
        self._on_start = on_start
        self._on_progress = on_progress
        self._tokens: set[str] = set()

    async def begin(self, token: str, where: str) -> None:
        """A process is at it, somewhere."""
        first = not self._tokens
        self._tokens.add(token)
        logger.info("work begins", extra={"work": token, "where": where})
        if first and self._on_start is not None:
            await self._on_start()

    def tell(self, share: float) -> None:
        """So much is done."""
        if self._on_progress is not None:
            self._on_progress(share)

    def take(self, token: str, wanted: str) -> None:
        """The folder of the process that did it is called as the job wants it."""
        work = self._folder.work(token)
        if work.exists():
            move_into_place(work, self._folder.work(wanted))

    def remove_what_is_left(self) -> None:
        """What a machine that was lost had begun."""
        for token in self._tokens:
            self._folder.remove(self._folder.work(token))


async def _outcome(future: Any) -> Over:
    """Raises WorkerDied, _ClusterLost."""
    from distributed import KilledWorker

    try:
        return cast(Over, await future)
    except KilledWorker as error:
        raise WorkerDied("the loss of its Dask workers") from error
    except (concurrent.futures.CancelledError, OSError, TimeoutError) as error:
        raise _ClusterLost(str(error)) from error
    except asyncio.CancelledError as error:
        task = asyncio.current_task()
        if task is not None and task.cancelling():
            raise
        raise _ClusterLost(str(error)) from error


def _told(over: Over, limit_s: float, order: Order, attempt: _Attempt) -> Mapping[str, object]:
    if over["failure"] is not None:
        raise TaskFailed(Failure(**over["failure"]))
    if over["died"] is not None:
        raise WorkerDied(over["died"])
    if over["late"] or over["result"] is None:
        raise TimeLimitError(
            f"The {order['task']} task took longer than {limit_s:g} s (setting SIGHTLINE_MAX_JOB_S); ask for less at "
            "once, or raise the limit."
        )
    attempt.take(over["token"], order["token"])
    return over["result"]
