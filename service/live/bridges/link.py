"""A link that lasts: read and written in a thread of its own, opened again when it is cut; it counts what it lost."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from .transports import Transport

__all__ = ["Link", "LinkCounts"]

POLL_S = 0.01
FIRST_WAIT_S, LONGEST_WAIT_S = 0.1, 5.0
MOST_WAITING = 1024


@dataclass(slots=True)
class LinkCounts:
    """What befell a link. unsent: messages that nobody could take in time, the oldest first; problem: the last one."""

    opened: int = 0
    cuts: int = 0
    bytes_in: int = 0
    unsent: int = 0
    problem: str = ""


class Link:
    """Reads until ``close``. In its thread, received is called with who sent it and what, idle between two reads."""

    def __init__(self, transport: Transport, received: Callable[[str, bytes], None], idle: Callable[[], None]) -> None:
        self.counts = LinkCounts()
        self._transport, self._received, self._idle = transport, received, idle
        self._waiting: deque[bytes] = deque()
        self._guard = threading.Lock()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="link", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def send(self, data: bytes) -> None:
        """Put a message in line; never waits. When too many wait the oldest is lost, and counted."""
        with self._guard:
            if len(self._waiting) >= MOST_WAITING:
                self._waiting.popleft()
                self.counts.unsent += 1
            self._waiting.append(data)

    def close(self) -> None:
        """End, and wait for it."""
        self._closed.set()
        if self._thread.is_alive():
            self._thread.join(2.0 * LONGEST_WAIT_S)

    def _run(self) -> None:
        wait_s = FIRST_WAIT_S
        while not self._closed.is_set():
            heard = self.counts.bytes_in
            try:
                self._transport.open()
                self.counts.opened += 1
                while not self._closed.is_set():
                    self._once()
            except OSError as error:
                self.counts.cuts += 1
                self.counts.problem = error.strerror or str(error)
            finally:
                self._transport.close()
            # one that said something before it was cut is soon there again
            wait_s = FIRST_WAIT_S if self.counts.bytes_in > heard else min(2.0 * wait_s, LONGEST_WAIT_S)
            self._closed.wait(wait_s)

    def _once(self) -> None:
        while True:
            with self._guard:
                data = self._waiting[0] if self._waiting else None
            if data is None:
                break
            self._transport.write(data)
            with self._guard:
                if self._waiting and self._waiting[0] is data:
                    self._waiting.popleft()
        for source, came in self._transport.poll(POLL_S):
            self.counts.bytes_in += len(came)
            self._received(source, came)
        self._idle()
