"""Live detectors: where epochs are judged, and what a session remembers."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import asdict, dataclass, replace
from typing import TypeVar

from detection import Calibrated
from planning.watching import Advice, Drive, WatchedEpoch
from service.access.callers import rooted
from service.errors import RequestError, TooManyError
from service.live.answers import as_json, calibration_answer, epoch_answer, state_answer
from service.live.drives import DriveIn, advice_answer, move_answer, path_answer
from service.live.keeping import Kept, SessionFolder
from service.live.limits import DetectorLimits
from service.live.request import EpochIn
from service.live.snapshots import freeze
from service.live.watching import NO_MAP, Memory

__all__ = ["Bench", "DetectorSession", "Watcher"]

Judged = TypeVar("Judged")
# An epoch of so many ranges is searched in a millisecond or two; a thread would take it longer.
LIGHT_RANGES = 8
# A watcher that is so many answers behind is not coming back.
WATCHED_ANSWERS = 256
ADVISED_S = 1.0  # so often, on the clock of the epochs, a session with a path is told what lies ahead
WITH_MAP = {"map_doubts": "map-doubts", "advice": "advice", "drive": "drive"}
NO_PATH = "The detector has no path: PUT one to its drive."
NO_PLACE = "The detector has no place yet: send epochs first."


class Bench:
    """One for the whole service, so that however many epochs wait, others wait for one of them at a time."""

    def __init__(self) -> None:
        self._floor = asyncio.Lock()
        self._beside = ThreadPoolExecutor(1, thread_name_prefix="epochs")

    async def judge(self, ranges: int, work: Callable[[], Judged]) -> Judged:
        """What the work on an epoch of so many ranges comes to."""
        if ranges > LIGHT_RANGES:
            return await self.beside(work)
        async with self._floor:
            judged = work()
            await asyncio.sleep(0)
        return judged

    async def beside(self, work: Callable[[], Judged]) -> Judged:
        """What heavier work comes to, while others are answered."""
        asked = copy_context()  # where it was asked decides what links begin with
        return await asyncio.get_running_loop().run_in_executor(self._beside, asked.run, work)

    def close(self) -> None:
        """Begin nothing more."""
        self._beside.shutdown(wait=False, cancel_futures=True)


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


@dataclass(slots=True)
class _Driven:
    """A path that is followed; changed in place. at_m: how far along it the rover was last; advised_s: when."""

    drive: Drive
    movable: tuple[str, ...]
    at_m: float | None = None
    advised_s: float = -math.inf

    @classmethod
    def of(cls, asked: DriveIn | None) -> _Driven | None:
        """Raises WatchError."""
        return None if asked is None else cls(asked.drive(), tuple(asked.movable or ()))

    def is_due(self, time_s: float) -> bool:
        """Whether advice is due, by the clock of the epochs; it counts as given then."""
        due = not abs(time_s - self.advised_s) < ADVISED_S
        if due:
            self.advised_s = time_s
        return due


class DetectorSession:
    """A session. Epochs are handled one after the other under ``turn``, whoever sends them.

    kept: what it was opened with. memory: of its detector. bench: shared by all sessions. folder: where it is kept so
    that it outlives the service; None = nowhere.
    """

    def __init__(
        self,
        kept: Kept,
        memory: Memory,
        limits: DetectorLimits,
        bench: Bench,
        clock: Callable[[], float],
        folder: SessionFolder | None = None,
    ) -> None:
        asked = kept.asked
        self.id = kept.id
        self.name = asked.name
        self.created_at = kept.created_at
        self.restored_at = kept.restored_at
        self.idle_timeout_s = kept.idle_timeout_s
        self.turn = asyncio.Lock()
        self.closed = asyncio.Event()
        self.malformed_messages = 0
        self._anchor_ids = [anchor.id for anchor in asked.anchors]
        self._settings = asked.settings.model_dump()
        self._dem_id = asked.dem_id
        self.memory = memory
        self._kept = kept
        if asked.drive is not None:
            self._check_drive(asked.drive)
        self._drive = _Driven.of(asked.drive)
        self.folder = folder
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
        return self._told(asked, self.memory.process(asked))

    async def answer_in_turn(self, asked: EpochIn) -> bytes:
        """The same where others have to be answered meanwhile."""
        async with self._judging:
            watched = await self._bench.judge(len(asked.ranges), lambda: self.memory.process(asked))
            if self.folder is not None:
                self.folder.keep(asked, lambda: freeze(self.memory))
            advice = None
            if self._drive is not None and self._drive.is_due(asked.time_s):
                advice = await self._bench.beside(self._advice)
        return self._told(asked, watched, advice)

    def _told(self, asked: EpochIn, watched: WatchedEpoch, advice: Advice | None = None) -> bytes:
        self.touch()
        over_map = self._dem_id is not None
        felt, inertial = self.memory.felt, self.memory.inertial
        imu = None if felt is None else {**asdict(felt), "riding": inertial is not None and inertial.riding}
        answer = as_json(epoch_answer(watched.result, asked.sequence, watched, advice, over_map=over_map, imu=imu))
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
        path = rooted(f"/detectors/{self.id}")
        left_s = self.idle_left_s
        return {
            "id": self.id,
            "name": self.name,
            "created_at": self.created_at,
            "restored_at": self.restored_at,
            "kept": self.folder is not None and self.folder.works,
            "acknowledged": self.memory.acknowledged,
            "idle_timeout_s": self.idle_timeout_s,
            "expires_in_s": None if left_s is None else max(0.0, left_s),
            "streams": self._streams,
            "malformed_messages": self.malformed_messages,
            "anchors": self._anchor_ids,
            "settings": self._settings,
            "dem_id": self._dem_id,
            "map_warnings": self.memory.detector.warnings,
            "links": {
                "self": path,
                "epochs": f"{path}/epochs",
                "stream": f"{path}/stream",
                **({name: f"{path}/{ends}" for name, ends in WITH_MAP.items()} if self._dem_id else {}),
            },
        }

    async def state_between_epochs(self) -> dict[str, object]:
        """``state``, not while an epoch is judged: the detector is half in the one before it then."""
        async with self._judging:
            return await self._bench.beside(self.state)

    async def follow(self, asked: DriveIn) -> None:
        """Take another path from now on. Raises RequestError without a map or for strange anchors, WatchError."""
        self._check_drive(asked)
        async with self._judging:
            self._drive = _Driven.of(asked)
            self._kept = replace(self._kept, asked=self._kept.asked.model_copy(update={"drive": asked}))
            if self.folder is not None:
                self.folder.rewrite(self._kept)

    @property
    def drive(self) -> DriveIn | None:
        """The path that it is told to follow; None without one."""
        return self._kept.asked.drive

    def _check_drive(self, asked: DriveIn) -> None:
        if self._dem_id is None:
            raise RequestError(NO_MAP)
        strange = next((name for name in asked.movable or () if name not in self._anchor_ids), None)
        if strange is not None:
            raise RequestError(f"movable: the session has no anchor {strange[:64]!r}.")

    async def advise(self) -> dict[str, object]:
        """What lies ahead, with a drone to move and a way round, in the words of ``FullAdviceOut``.

        Raises RequestError without map, path or place.
        """
        async with self._judging:
            advice = await self._bench.beside(self._advice)
            if self._drive is None or advice is None:
                raise RequestError(NO_PATH if self._drive is None else NO_PLACE)
            driven, move, path = self._drive, None, None
        if advice.stretches:
            detector, first = self.memory.detector, advice.stretches[0]
            if driven.movable:
                move = move_answer(await asyncio.to_thread(detector.advise_move, driven.drive, first, driven.movable))
            path = path_answer(await asyncio.to_thread(detector.advise_path, driven.drive, first, advice.at_m))
        return {**advice_answer(advice), "move": move, "path": path}

    def _advice(self) -> Advice | None:
        if self._drive is None:
            return None
        advice = self.memory.detector.advise(self._drive.drive, self._drive.at_m)
        if advice is not None:
            self._drive.at_m = advice.at_m
        return advice

    async def calibration(self, what: Calibrated) -> dict[str, object]:
        """What its latest epochs say its ranges are off, in the words of ``CalibrationOut``; nothing is applied."""
        async with self._judging:
            found = await self._bench.beside(lambda: self.memory.detector.calibration(what))
        return calibration_answer(what, found)

    async def map_doubts(self) -> bytes:
        """Where its ranges contradict the map, as GeoJSON. Raises RequestError where it looks at none."""
        async with self._judging:
            return self.memory.detector.map_doubts()

    def state(self) -> dict[str, object]:
        """The same with what the detector remembers, in the words of ``DetectorStateful``."""
        detector = self.memory.detector
        return {**self.description(), "state": state_answer(detector.state, detector.suspicions())}
