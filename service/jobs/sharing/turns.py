"""Places for so many at once, taken in turn: whoever has much waiting does not hold up who has little."""

from __future__ import annotations

import asyncio
from collections import OrderedDict, deque

__all__ = ["Turns"]


class Turns:
    """Places; while there are none, one of each client that waits is taken after another, each client's in order."""

    def __init__(self, places: int) -> None:
        self._free = places
        self._waiting: OrderedDict[str, deque[asyncio.Future[None]]] = OrderedDict()

    def waiting(self, client: str) -> int:
        """How many wait for that client."""
        return len(self._waiting.get(client, ()))

    async def acquire(self, client: str) -> None:
        """Take a place, as soon as it is the client's turn."""
        if self._free and not self._waiting:
            self._free -= 1
            return
        mine = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(client, deque()).append(mine)
        try:
            await mine
        except asyncio.CancelledError:
            if mine.done() and not mine.cancelled():
                self.release()  # it was ours already
            else:
                self._forget(client, mine)
            raise

    def release(self) -> None:
        """Give a place back."""
        while self._waiting:
            client, queue = self._waiting.popitem(last=False)
            first = queue.popleft()
            if queue:
                self._waiting[client] = queue
            if not first.done():  # who gave up just now is in the queue still
                first.set_result(None)
                return
        self._free += 1

    def _forget(self, client: str, mine: asyncio.Future[None]) -> None:
        queue = self._waiting.get(client)
        if queue is not None and mine in queue:
            queue.remove(mine)
            if not queue:
                del self._waiting[client]
