"""One live detector: its memory, who listens to it, and when it was last used."""

from __future__ import annotations

import asyncio
import datetime
from collections.abc import Callable
from typing import Any

from detection import Detector, EpochResult
from service.errors import RequestError, TooManyError
from service.live.answers import as_json, epoch_answer, state_answer
from service.live.limits import DetectorLimits
from service.live.request import DetectorIn, EpochIn
from service.live.sessions import Bench, Occlusions

__all__ = ["DetectorSession", "Watcher"]

# A watcher that is so many answers behind is not coming back.
WATCHED_ANSWERS = 256


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

    bench: shared by all sessions.
    Raises DetectionInputError, LimitError.
    """

    def __init__(
        self,
        id: str,
        asked: DetectorIn,
        limits: DetectorLimits,
        bench: Bench,
        clock: Callable[[], float],
        idle_timeout_s: float,
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
        self._detector = Detector([anchor.anchor() for anchor in asked.anchors], asked.settings.settings())
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
            result = await self._bench.judge(len(asked.ranges), lambda: self._detector.process(asked.epoch()))
        return self._told(asked, result)

    def _told(self, asked: EpochIn, result: EpochResult) -> bytes:
        self.touch()
        self.occlusions.take_in(result)
        answer = as_json(epoch_answer(result, asked.sequence))
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

    def description(self) -> dict[str, Any]:
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
            "links": {"self": path, "epochs": f"{path}/epochs", "stream": f"{path}/stream"},
        }

    async def state_between_epochs(self) -> dict[str, Any]:
        """``state``, not while an epoch is judged: the detector is half in the one before it then."""
        async with self._judging:
            return self.state()

    def state(self) -> dict[str, Any]:
        """The same with what the detector remembers, in the words of ``DetectorStateful``."""
        return {**self.description(), "state": state_answer(self._detector.state, self._detector.suspicions())}
