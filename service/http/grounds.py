"""DEMs on their way from the ground library: followed, stopped, and made once for all who ask."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine
from dataclasses import dataclass

from service.access.callers import acting_tenant
from service.errors import JobCancelledError
from service.jobs.records import DemRecord

__all__ = ["GroundUnderWay", "Grounds"]

# that failed or were ended, so that whoever follows them hears why
MOST_FAILED = 100
Make = Callable[[Callable[[float], None]], Coroutine[None, None, DemRecord]]


@dataclass(eq=False, slots=True)
class GroundUnderWay:
    """A DEM that is being made. since_s: seconds since 1970 UTC. progress: finished share, 0..1."""

    dem_id: str
    since_s: float
    making: asyncio.Task[DemRecord]
    progress: float = 0.0

    async def wait(self, seconds: float | None) -> DemRecord | None:
        """The DEM once it is made, None after so many seconds; None waits to the end.

        Raises what making it raised, JobCancelledError.
        """
        await asyncio.wait({self.making}, timeout=seconds)
        return self.outcome()

    def outcome(self) -> DemRecord | None:
        """The DEM, None while it is under way. Raises as ``wait``."""
        if not self.making.done():
            return None
        if self.making.cancelled():
            raise JobCancelledError("The DEM was cancelled before it was made.")
        return self.making.result()


class Grounds:
    """Lives in the event loop; a restart forgets what was under way, and asking again begins it again.

    Each tenant's are its own, as its DEMs are.
    """

    def __init__(self) -> None:
        self._known: dict[tuple[str, str], GroundUnderWay] = {}

    def begin(self, dem_id: str, make: Make) -> GroundUnderWay:
        """The DEM of that id under way, begun now unless it is already; make: takes whom to tell the finished share."""
        known = self.known(dem_id)
        if known is not None and not known.making.done():
            return known

        def tell(share: float) -> None:
            ground.progress = share

        async def made() -> DemRecord:
            return await make(tell)

        key = (acting_tenant(), dem_id)
        ground = GroundUnderWay(dem_id, time.time(), asyncio.create_task(made()))
        self._known[key] = ground
        ground.making.add_done_callback(lambda _: self._over(key, ground))
        return ground

    def known(self, dem_id: str) -> GroundUnderWay | None:
        """One of the acting tenant's that is under way, or failed or was ended lately."""
        return self._known.get((acting_tenant(), dem_id))

    async def end(self, dem_id: str) -> GroundUnderWay | None:
        """End the making of one, and whoever waits for it hears so; one that was ended comes back as it is.

        None where none is under way, or it is made now.
        """
        ground = self.known(dem_id)
        if ground is None:
            return None
        ground.making.cancel()
        await asyncio.wait({ground.making})
        return ground if ground.making.cancelled() else None

    async def stop(self) -> None:
        """End all."""
        under_way = [ground.making for ground in self._known.values()]
        for making in under_way:
            making.cancel()
        await asyncio.gather(*under_way, return_exceptions=True)

    def _over(self, key: tuple[str, str], ground: GroundUnderWay) -> None:
        made = not ground.making.cancelled() and ground.making.exception() is None
        if self._known.get(key) is ground and made:
            del self._known[key]
        over = [key for key, one in self._known.items() if one.making.done()]
        for oldest in over[:-MOST_FAILED]:
            del self._known[oldest]
