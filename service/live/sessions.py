"""Live detectors: where epochs are judged, and what a session remembers."""

from __future__ import annotations

import asyncio
import datetime
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from detection import EpochResult
from planning.watching import WatchedEpoch
from service.errors import RequestError, TooManyError
from service.live.answers import as_json, epoch_answer, state_answer
from service.live.request import DetectorIn, DetectorLimits, EpochIn
from service.live.watching import detector_of
from terrain import ElevationGrid

__all__ = ["Bench", "DetectorSession", "Occlusions", "Watcher"]

Judged = TypeVar("Judged")
# An epoch of so many ranges is searched in a millisecond or two; a thread would take it longer.
LIGHT_RANGES = 8
# A watcher that is so many answers behind is not coming back.
WATCHED_ANSWERS = 256


class Bench:
    """One for the whole service, so that however many epochs wait, others wait for one of them at a time."""

    def __init__(self) -> None:
        self._floor = asyncio.Lock()
        self._beside = ThreadPoolExecutor(1, thread_name_prefix="epochs")

    async def judge(self, ranges: int, work: Callable[[], Judged]) -> Judged:
        """What the work on an epoch of so many ranges comes to."""
        if ranges > LIGHT_RANGES:
            return await asyncio.get_running_loop().run_in_executor(self._beside, work)
        async with self._floor:
            judged = work()
            await asyncio.sleep(0)
        return judged

    def close(self) -> None:
        """Begin nothing more."""
        self._beside.shutdown(wait=False, cancel_futures=True)


class Occlusions:
    """For each anchor, from when to when every one of its ranges has been occluded."""

    def __init__(self) -> None:
        self._runs: dict[str, tuple[float, float]] = {}

    def take_in(self, result: EpochResult) -> None:
        """Verdicts of one epoch; one that is unknown neither ends a run nor begins one."""
        for verdict in result.verdicts:
            if verdict.occluded:
                since_s, _ = self._runs.get(verdict.anchor_id, (result.time_s, result.time_s))
                self._runs[verdict.anchor_id] = since_s, result.time_s
            elif verdict.sight in ("clear", "too short"):
                self._runs.pop(verdict.anchor_id, None)

    def lasting(self, at_least_s: float) -> list[str]:
        """Ids of the anchors whose ranges have been occluded so long, in the order in which that began."""
        runs = sorted(self._runs.items(), key=lambda run: run[1])
        return [anchor_id for anchor_id, (since_s, until_s) in runs if until_s - since_s >= at_least_s]


class Watcher:
    """Somebody who listens; ``lost`` once answers came faster than they were taken."""

    def __init__(self) -> None:
        self.answers: asyncio.Queue[bytes] = asyncio.Queue(WATCHED_ANSWERS)
        self.lost = asyncio.Event()

    def tell(self, answer: bytes) -> None:
        """Put the answer in line, or give up on the watcher when the line is full."""
        try:
            self.answers.put_nowait(answer)
        except asyncio.QueueFull:
            self.lost.set()


class DetectorSession:
    """A session. Epochs are handled one after the other under ``turn``, whoever sends them.

    bench: shared by all sessions. grid: of the DEM that it looks at; None = none.
    Raises DetectionInputError, WatchError, LimitError.
    """

    def __init__(
        self,
        id: str,
        asked: DetectorIn,
        limits: DetectorLimits,
        bench: Bench,
        clock: Callable[[], float],
        idle_timeout_s: float,
        grid: ElevationGrid | None = None,
    ) -> None:
        limits.check_detector(asked)
        self.id = id
        self.name = asked.name
        self.created_at = datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")
        self.idle_timeout_s = idle_timeout_s
        self.turn = asyncio.Lock()
        self.closed = asyncio.Event()
        self.malformed_messages = 0
        self._anchor_ids = [anchor.id for anchor in asked.anchors]
        self._settings = asked.settings.model_dump()
        self.occlusions = Occlusions()
        self._dem_id = asked.dem_id
        self._detector = detector_of(asked, grid)
        self.limits = limits
        self._bench = bench
        self._judging = asyncio.Lock()
        self._clock = clock
        self._used_at_s = clock()
        self._streams = 0
        self._watchers: set[Watcher] = set()

    def check(self, asked: EpochIn) -> None:
        """Raise LimitError or RequestError where an epoch cannot be taken in."""
        self.limits.check_epoch(asked)
        strange = next((anchor.id for anchor in asked.moved if anchor.id not in self._anchor_ids), None)
        if strange is not None:
            raise RequestError(f"moved: the session has no anchor {strange[:64]!r}; make a new session with it.")

    def answer(self, asked: EpochIn) -> bytes:
        """The detector's answer to one epoch that was checked, as JSON; every watcher gets it too."""
        return self._told(asked, self._detector.process(asked.epoch()))

    async def answer_in_turn(self, asked: EpochIn) -> bytes:
        """The same where others have to be answered meanwhile."""
        async with self._judging:
            watched = await self._bench.judge(len(asked.ranges), lambda: self._detector.process(asked.epoch()))
        return self._told(asked, watched)

    def _told(self, asked: EpochIn, watched: WatchedEpoch) -> bytes:
        self.touch()
        self.occlusions.take_in(watched.result)
        answer = as_json(epoch_answer(watched.result, asked.sequence, watched if self._dem_id else None))
        for watcher in self._watchers:
            watcher.tell(answer)
        return answer

    def watch(self) -> Watcher:
        """Somebody who gets every answer from now on, until ``forget``."""
        watcher = Watcher()
        self._watchers.add(watcher)
        return watcher

    def forget(self, watcher: Watcher) -> None:
        """The end of ``watch``."""
        self._watchers.discard(watcher)

    def open_stream(self) -> None:
        """One stream more, until ``close_stream``. Raises TooManyError."""
        limit = self.limits.max_streams
        if self._streams >= limit:
            raise TooManyError(
                f"The session has {limit} streams, as many as it may", limit_name="max_detector_streams", limit=limit
            )
        self._streams += 1

    def close_stream(self) -> None:
        """The end of ``open_stream``; the idle time begins."""
        self._streams -= 1
        self.touch()

    def touch(self) -> None:
        """It is in use: its idle time begins anew."""
        self._used_at_s = self._clock()

    @property
    def idle_left_s(self) -> float | None:
        """Seconds until it expires; None while a stream is open."""
        return None if self._streams else self._used_at_s + self.idle_timeout_s - self._clock()

    def description(self) -> dict[str, object]:
        """The session in the words of ``DetectorOut``."""
        path = f"/detectors/{self.id}"
        left_s = self.idle_left_s
        return {
            "id": self.id,
            "name": self.name,
            "created_at": self.created_at,
            "idle_timeout_s": self.idle_timeout_s,
            "expires_in_s": None if left_s is None else max(0.0, left_s),
            "streams": self._streams,
            "malformed_messages": self.malformed_messages,
            "anchors": self._anchor_ids,
            "settings": self._settings,
            "dem_id": self._dem_id,
            "map_warnings": self._detector.warnings,
            "links": {
                "self": path,
                "epochs": f"{path}/epochs",
                "stream": f"{path}/stream",
                **({"map_doubts": f"{path}/map-doubts"} if self._dem_id else {}),
            },
        }

    async def state_between_epochs(self) -> dict[str, object]:
        """``state``, not while an epoch is judged: the detector is half in the one before it then."""
        async with self._judging:
            return self.state()

    async def map_doubts(self) -> bytes:
        """Where its ranges contradict the map, as GeoJSON. Raises RequestError where it looks at none."""
        async with self._judging:
            return self._detector.map_doubts()

    def state(self) -> dict[str, object]:
        """The same with what the detector remembers, in the words of ``DetectorStateful``."""
        return {**self.description(), "state": state_answer(self._detector.state, self._detector.suspicions())}
