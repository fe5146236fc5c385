"""Where epochs are judged: light ones between two turns of the event loop, heavy ones beside it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

__all__ = ["Bench"]

Judged = TypeVar("Judged")
# An epoch of so many ranges is searched in a millisecond or two; a thread would take it longer.
LIGHT_RANGES = 8


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
