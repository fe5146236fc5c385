"""Live detectors by id: how many there may be, and when they end."""

from __future__ import annotations

import asyncio
import datetime
import logging
import time
import uuid
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path

from detection import DetectionError
from planning import PlanningError
from service.access.callers import CALLER, acting_tenant, seen_tenant
from service.errors import BusyError, GoneError, LimitError, NotFoundError, ServiceError, TooManyError
from service.live.keeping import Kept, SessionFolder, kept_in
from service.live.limits import DetectorLimits
from service.live.request import DetectorIn
from service.live.sessions import Bench, DetectorSession
from service.live.snapshots import SnapshotError, freeze, thaw
from service.live.watching import Memory, memory_of
from service.parts.cover import covered
from service.parts.map_area import area_shape
from service.settings import Settings
from terrain import ElevationGrid

__all__ = ["Detectors"]

SWEEP_EVERY_S = 1.0

logger = logging.getLogger("sightline.http")
# of so many sessions that are over it is remembered how they ended
REMEMBERED = 10_000
UNKNOWN = "it may have expired before the service was started again"


class Detectors:
    """Live sessions by id. folder: where they are kept, so that the next service goes on with them; None = nowhere."""

    def __init__(
        self, settings: Settings, clock: Callable[[], float] = time.monotonic, folder: Path | None = None
    ) -> None:
        self._folder = folder
        self.limits = DetectorLimits.of(settings)
        self._max_sessions = settings.max_detectors
        self._max_of_tenant = settings.max_tenant_detectors
        self._max_idle_s = settings.max_detector_idle_s
        self._max_cells = settings.max_dem_cells
        self._clock = clock
        self.bench = Bench()
        self._sessions: dict[str, DetectorSession] = {}
        self._tenants: dict[str, str] = {}
        self._over: OrderedDict[str, str] = OrderedDict()

    def __len__(self) -> int:
        """How many there are that may be seen now."""
        return sum(self._is_seen(id) for id in self._sessions)

    def open(self, asked: DetectorIn, grid: ElevationGrid | None = None) -> DetectorSession:
        """A new session; grid: of its dem_id with what stands there.

        Raises LimitError and its kinds, DetectionInputError, WatchError.
        """
        self.sweep()
        if len(self._sessions) >= self._max_sessions:
            raise BusyError(
                f"{self._max_sessions} detectors are open, as many as there may be; delete one",
                limit_name="max_detectors",
                limit=self._max_sessions,
            )
        caller = CALLER.get()
        if caller is not None and not caller.address and len(self) >= self._max_of_tenant:
            raise TooManyError(
                f"{self._max_of_tenant} detectors of this tenant are open, as many as there may be; delete one",
                limit_name="max_tenant_detectors",
                limit=self._max_of_tenant,
            )
        idle_s = self._max_idle_s if asked.idle_timeout_s is None else asked.idle_timeout_s
        if idle_s > self._max_idle_s:
            raise LimitError(
                f"idle_timeout_s is {idle_s:g}, more than the limit of {self._max_idle_s:g} s",
                limit_name="max_detector_idle_s",
                limit=self._max_idle_s,
                given=idle_s,
            )
        self.limits.check_detector(asked)
        kept, memory = Kept(uuid.uuid4().hex, _now(), idle_s, asked, tenant=acting_tenant()), memory_of(asked, grid)
        where = None
        if self._folder is not None:
            try:
                where = SessionFolder.of(self._folder / kept.id, kept, freeze(memory))
            except OSError as error:
                logger.error("detector %s is not kept: %s", kept.id, error)
        self._tenants[kept.id] = kept.tenant
        return self._take(DetectorSession(kept, memory, self.limits, self.bench, self._clock, where))

    def restore(self, grid_of: Callable[[str], ElevationGrid]) -> None:
        """Go on with the sessions that the last service left; grid_of: of a DEM, by id, raising where it is gone."""
        if self._folder is None:
            return
        for kept, folder in kept_in(self._folder, _now()):
            self._tenants[kept.id] = kept.tenant
            dem_id = kept.asked.dem_id
            try:
                grid = None if dem_id is None else covered(grid_of(dem_id), kept.asked, self._max_cells)
                memory = _recalled(kept, folder, grid)
                folder.go_on(freeze(memory))
            except (OSError, ServiceError, DetectionError, PlanningError) as error:
                logger.warning("detector %s cannot be gone on with: %s", kept.id, error)
                self._over[kept.id] = f"could not be gone on with when the service started again ({error})"
                folder.remove()
                continue
            except Exception:
                # a fault of ours must not keep the service from starting, nor take what is kept
                logger.exception("detector %s could not be gone on with; it stays where it is", kept.id)
                self._over[kept.id] = "could not be gone on with when the service started again, for a fault of ours"
                folder.close()
                continue
            self._take(DetectorSession(kept, memory, self.limits, self.bench, self._clock, folder))

    def _take(self, session: DetectorSession) -> DetectorSession:
        self._sessions[session.id] = session
        return session

    def get(self, id: str) -> DetectorSession:
        """The session, which is in use now. Raises NotFoundError, or GoneError where it is over."""
        if not self._is_seen(id):
            raise NotFoundError("detector", id, UNKNOWN)
        session = self._sessions.get(id)
        if session is not None and _expired(session):
            self._end(session, _why_expired(session))
            session = None
        if session is None:
            if id in self._over:
                raise GoneError(f"Detector {id[:80]!r} {self._over[id]}; make a new one.")
            raise NotFoundError("detector", id, UNKNOWN)
        session.touch()
        return session

    def newest_first(self) -> list[DetectorSession]:
        """Those that may be seen now; by id where they were made in the same moment."""
        self.sweep()
        seen = sorted((one for one in self._sessions.values() if self._is_seen(one.id)), key=lambda one: one.id)
        return sorted(seen, key=lambda one: one.created_at, reverse=True)

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
            folders = [session.folder for session in self._sessions.values() if session.folder is not None]
            await asyncio.to_thread(_make_durable, folders)

    def close(self) -> None:
        """The service stops; what is kept stays."""
        self.bench.close()
        for session in self._sessions.values():
            if session.folder is not None:
                session.folder.close()

    def _end(self, session: DetectorSession, how: str) -> None:
        del self._sessions[session.id]
        session.closed.set()
        if session.folder is not None:
            session.folder.remove()
        self._over[session.id] = how
        if len(self._over) > REMEMBERED:
            forgotten, _ = self._over.popitem(last=False)
            self._tenants.pop(forgotten, None)

    def _is_seen(self, id: str) -> bool:
        tenant = seen_tenant()
        return tenant is None or self._tenants.get(id) == tenant


def _recalled(kept: Kept, folder: SessionFolder, grid: ElevationGrid | None) -> Memory:
    """What a session remembered when the last service ended: its last memory, and what came after it.

    One of another release is made anew from all epochs that are kept.
    """
    memory = memory_of(kept.asked, grid)
    area = None if grid is None else area_shape(grid, kept.asked.area)
    for part in folder.parts():
        try:
            memory = thaw(part.memory, grid, area)
        except SnapshotError as error:
            logger.warning("detector %s: its track is made anew from the epochs that are kept: %s", kept.id, error)
        for epoch in part.epochs:
            memory.process(epoch)
    return memory


def _make_durable(folders: list[SessionFolder]) -> None:
    for folder in folders:
        try:
            folder.make_durable()
        except OSError as error:
            logger.error("a session may not outlive a loss of power: %s", error)


def _now() -> str:
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")


def _expired(session: DetectorSession) -> bool:
    left_s = session.idle_left_s
    return left_s is not None and left_s <= 0.0


def _why_expired(session: DetectorSession) -> str:
    return f"expired after {session.idle_timeout_s:g} s without a request"
