"""A bridge: what a link brings goes to a detector in this process, what that says goes back; losses are counted."""

from __future__ import annotations

import queue
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol

from detection import RangeEpoch, Rejection
from planning.watching import WatchedEpoch

from .link import Link, LinkCounts
from .transports import Transport

__all__ = ["Asked", "Bridge", "BridgeCounts", "Codec"]

MOST_WAITING = 256
REMEMBERED = 512
PAST = (Rejection.DUPLICATE, Rejection.OUT_OF_ORDER, Rejection.LATE)


@dataclass(frozen=True, slots=True)
class Asked:
    """An epoch that came over a link. key: by which whoever sent it knows it again."""

    epoch: RangeEpoch
    key: float | int


class Codec(Protocol):
    """The language of a link. What comes is taken in the link's thread, what goes is made in the detector's."""

    @property
    def bad(self) -> int:
        """Bytes or lines that made no sense."""
        ...

    def received(self, source: str, data: bytes) -> Iterable[Asked]:
        """The epochs that are complete by what came."""
        ...

    def idle(self) -> Iterable[Asked]:
        """The same where time alone completes one."""
        ...

    def due(self) -> Iterable[bytes]:
        """What is to be sent by the clock, or in answer to what came."""
        ...

    def answer(self, asked: Asked, watched: WatchedEpoch) -> list[bytes]:
        """The messages that tell what the detector says."""
        ...

    def lost(self, asked: Asked) -> list[bytes]:
        """The messages that tell of an epoch that nobody judged, because too many waited."""
        ...


@dataclass(slots=True)
class BridgeCounts:
    """What a bridge did. epochs: judged; repeated: answered again; lost: because too many waited."""

    epochs: int = 0
    ranges: int = 0
    occluded: int = 0
    positions: int = 0
    repeated: int = 0
    lost: int = 0


class Bridge:
    """Joins a link and a detector. process: the detector; judged: told of each epoch and what was said, in its thread.

    The link never waits for the detector, nor the detector for the link.
    """

    def __init__(
        self,
        transport: Transport,
        codec: Codec,
        process: Callable[[RangeEpoch], WatchedEpoch],
        judged: Callable[[Asked, WatchedEpoch], None] = lambda asked, watched: None,
    ) -> None:
        self.counts = BridgeCounts()
        self._codec, self._process, self._judged = codec, process, judged
        self._waiting: queue.Queue[Asked] = queue.Queue(MOST_WAITING)
        self._told: OrderedDict[float | int, list[bytes]] = OrderedDict()
        self._link = Link(transport, self._received, self._idle)

    @property
    def bad(self) -> int:
        """Bytes or lines that made no sense."""
        return self._codec.bad

    @property
    def link_counts(self) -> LinkCounts:
        """What befell the link."""
        return self._link.counts

    def run(self, stop: threading.Event, every: Callable[[], None] = lambda: None, every_s: float = 10.0) -> None:
        """Judge epochs until told to stop. every: called every so many seconds."""
        self._link.start()
        next_s = time.monotonic() + every_s
        try:
            while not stop.is_set():
                if time.monotonic() >= next_s:
                    next_s += every_s
                    every()
                try:
                    asked = self._waiting.get(timeout=0.05)
                except queue.Empty:
                    continue
                self._judge(asked)
        finally:
            self._link.close()

    def _judge(self, asked: Asked) -> None:
        watched = self._process(asked.epoch)
        result = watched.result
        if result.rejection in PAST and asked.key in self._told:
            # its answer was lost on the way: the same again
            self.counts.repeated += 1
            said = self._told[asked.key]
        else:
            self.counts.epochs += 1
            self.counts.ranges += len(result.verdicts)
            self.counts.occluded += sum(verdict.occluded for verdict in result.verdicts)
            self.counts.positions += result.position is not None
            said = self._codec.answer(asked, watched)
            self._told[asked.key] = said
            if len(self._told) > REMEMBERED:
                self._told.popitem(last=False)
            self._judged(asked, watched)
        for message in said:
            self._link.send(message)

    def _received(self, source: str, data: bytes) -> None:
        self._put(self._codec.received(source, data))

    def _idle(self) -> None:
        self._put(self._codec.idle())
        for message in self._codec.due():
            self._link.send(message)

    def _put(self, epochs: Iterable[Asked]) -> None:
        for asked in epochs:
            while True:
                try:
                    self._waiting.put_nowait(asked)
                    break
                except queue.Full:
                    self._drop_oldest()

    def _drop_oldest(self) -> None:
        try:
            oldest = self._waiting.get_nowait()
        except queue.Empty:
            return
        self.counts.lost += 1
        for message in self._codec.lost(oldest):
            self._link.send(message)
