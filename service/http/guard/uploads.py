"""Places for bodies that are written to disk as they come: in turns, within a budget, and not for who trickles."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from service.access.callers import acting_client
from service.errors import BusyError, TooSlowError
from service.jobs.sharing.turns import Turns
from service.settings import Settings

__all__ = ["Place", "Uploads"]

# Who is slower gives up its place while others wait for one; every link of today is quicker.
SLOW_BYTES_PER_S = 16 * 1024
JUDGED_S = 2.0
# Small ones have places of their own: they are in and out before the large ones of others are.
SMALL_BYTES, SMALL_PLACES = 1024 * 1024, 64
WAIT_S = 15.0
LOOK_EVERY_S = 0.5


class Place:
    """An upload that is being received."""

    def __init__(self, uploads: Uploads, until: asyncio.Timeout) -> None:
        self._uploads = uploads
        self._until = until
        self._since_s, self._came_bytes = asyncio.get_running_loop().time(), 0
        self.bytes = 0
        self.receiving = True

    def take(self, number: int) -> None:
        """So many bytes more came. Raises BusyError when all uploads together have as many as they may."""
        self.bytes += number
        self._uploads.take(number)

    def bytes_per_s(self, now_s: float) -> float | None:
        """How quick it has been of late; None when it is too early to tell, or everything has come."""
        passed_s = now_s - self._since_s
        if not self.receiving or passed_s < JUDGED_S:
            return None
        came, self._since_s, self._came_bytes = self.bytes - self._came_bytes, now_s, self.bytes
        return came / passed_s

    def give_up(self) -> None:
        """Receive no more."""
        self._until.reschedule(0.0)
        self.receiving = False


class Uploads:
    """So many uploads at a time, clients in turns; while one waits, those that trickle lose their places."""

    def __init__(self, settings: Settings) -> None:
        self._most, self._most_bytes = settings.max_uploads, settings.max_incoming_bytes
        self._large, self._small = Turns(self._most), Turns(SMALL_PLACES)
        self._places: set[Place] = set()
        self._bytes = 0
        self._waiting = 0
        self._judging = False

    @asynccontextmanager
    async def place(self, told_bytes: int | None) -> AsyncIterator[Place]:
        """A place for the block. told_bytes: the length of the body, where the client tells it.

        Raises BusyError when there is none in time, TooSlowError when it was lost.
        """
        turns = self._large if told_bytes is None or told_bytes > SMALL_BYTES else self._small
        await self._enter(turns)
        place: Place | None = None
        try:
            async with asyncio.timeout(None) as until:
                place = Place(self, until)
                self._places.add(place)
                yield place
        except TimeoutError as error:
            if place is None or not until.expired():
                raise
            raise TooSlowError("The body came too slowly, and others waited for its place; send it again.") from error
        finally:
            if place is not None:
                self._places.discard(place)
                self._bytes -= place.bytes
            turns.release()

    def take(self, number: int) -> None:
        """So many bytes more lie on disk. Raises BusyError."""
        self._bytes += number
        if self._bytes > self._most_bytes:
            raise BusyError(
                f"Uploads under way have {self._most_bytes:,} bytes, which is the limit; try again in a moment",
                limit_name="max_incoming_bytes",
                limit=self._most_bytes,
            )

    async def _enter(self, turns: Turns) -> None:
        self._waiting += 1
        self._judge_later()
        try:
            async with asyncio.timeout(WAIT_S):
                await turns.acquire(acting_client())
        except TimeoutError as error:
            raise BusyError(
                f"{self._most} uploads are under way, which is the limit; try again in a moment",
                limit_name="max_uploads",
                limit=self._most,
            ) from error
        finally:
            self._waiting -= 1

    def _judge_later(self) -> None:
        if not self._judging:
            self._judging = True
            asyncio.get_running_loop().call_later(LOOK_EVERY_S, self._judge)

    def _judge(self) -> None:
        """For each that waits one that trickles loses its place, the slowest first."""
        self._judging = False
        if not self._waiting:
            return
        now_s = asyncio.get_running_loop().time()
        slow = [(rate, place) for place in self._places if (rate := place.bytes_per_s(now_s)) is not None]
        for rate, place in sorted(slow, key=lambda each: each[0])[: self._waiting]:
            if rate < SLOW_BYTES_PER_S:
                place.give_up()
        self._judge_later()
