"""Live detectors by id: how many there may be, and when they end."""

from __future__ import annotations

import asyncio
import time
import uuid
from collections import OrderedDict
from collections.abc import Callable

from service.errors import BusyError, GoneError, LimitError, NotFoundError
from service.live.request import DetectorIn, DetectorLimits
from service.live.sessions import Bench, DetectorSession
from service.settings import Settings
from terrain import ElevationGrid

__all__ = ["Detectors"]

SWEEP_EVERY_S = 1.0
# of so many sessions that are over it is remembered how they ended
REMEMBERED = 10_000


class Detectors:
    """Live sessions by id. They live in this process's memory alone and end with it."""

    def __init__(self, settings: Settings, clock: Callable[[], float] = time.monotonic) -> None:
        self.limits = DetectorLimits.of(settings)
        self._max_sessions = settings.max_detectors
        self._max_idle_s = settings.max_detector_idle_s
        self._clock = clock
        self.bench = Bench()
        self._sessions: dict[str, DetectorSession] = {}
        self._over: OrderedDict[str, str] = OrderedDict()

    def __len__(self) -> int:
        return len(self._sessions)

    def open(self, asked: DetectorIn, grid: ElevationGrid | None = None) -> DetectorSession:
        """A new session; grid: of its dem_id. Raises BusyError, LimitError, DetectionInputError, WatchError."""
        self.sweep()
        if len(self._sessions) >= self._max_sessions:
            raise BusyError(
                f"{self._max_sessions} detectors are open, as many as there may be; delete one",
                limit_name="max_detectors",
                limit=self._max_sessions,
            )
        idle_s = self._max_idle_s if asked.idle_timeout_s is None else asked.idle_timeout_s
        if idle_s > self._max_idle_s:
            raise LimitError(
                f"idle_timeout_s is {idle_s:g}, more than the limit of {self._max_idle_s:g} s",
                limit_name="max_detector_idle_s",
                limit=self._max_idle_s,
                given=idle_s,
            )
        session = DetectorSession(uuid.uuid4().hex, asked, self.limits, self.bench, self._clock, idle_s, grid)
        self._sessions[session.id] = session
        return session

    def get(self, id: str) -> DetectorSession:
        """The session, which is in use now. Raises NotFoundError, or GoneError where it is over."""
        session = self._sessions.get(id)
        if session is not None and _expired(session):
            self._end(session, _why_expired(session))
            session = None
        if session is None:
            if id in self._over:
                raise GoneError(f"Detector {id[:80]!r} {self._over[id]}; make a new one.")
            raise NotFoundError("detector", id, "detectors do not survive a restart of the service")
        session.touch()
        return session

    def page(self, limit: int, offset: int) -> list[DetectorSession]:
        """Sessions, newest first."""
        self.sweep()
        return list(reversed(self._sessions.values()))[offset : offset + limit]

    def delete(self, id: str) -> None:
        """End the session and its streams. Raises NotFoundError, GoneError."""
        self._end(self.get(id), "was deleted")

    def sweep(self) -> None:
        """End the sessions whose idle time is over."""
        for session in [session for session in self._sessions.values() if _expired(session)]:
            self._end(session, _why_expired(session))

    async def keep_sweeping(self) -> None:
        """Sweep for as long as the service runs."""
        while True:
            await asyncio.sleep(SWEEP_EVERY_S)
            self.sweep()

    def _end(self, session: DetectorSession, how: str) -> None:
        del self._sessions[session.id]
        session.closed.set()
        self._over[session.id] = how
        if len(self._over) > REMEMBERED:
            self._over.popitem(last=False)


def _expired(session: DetectorSession) -> bool:
    left_s = session.idle_left_s
    return left_s is not None and left_s <= 0.0


def _why_expired(session: DetectorSession) -> str:
    return f"expired after {session.idle_timeout_s:g} s without a request"
