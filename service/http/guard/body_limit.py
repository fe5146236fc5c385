"""No request body is read beyond its limit; a client that is refused is answered at once, and then heard out."""

from __future__ import annotations

import asyncio
import contextlib
from collections import Counter
from collections.abc import Iterable, Mapping

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.access.callers import acting_client
from service.errors import BodyTooLargeError, BusyError, NotJsonError
from service.http.problems import answer_to
from service.settings import Settings

__all__ = ["BodyLimit", "body_limits", "too_large"]

# A client still sends while it is refused. Closing on it then shows it a broken connection instead of our answer.
HEARD_OUT_BYTES = 16 * 1024 * 1024
HEARD_OUT_S = 10.0
# of each body so much does not count
FREE_BYTES = 64 * 1024


TWO_LENGTHS = "The request has Content-Length and Transfer-Encoding, which tell two lengths of its body; send one."
BodyLimits = Mapping[str, tuple[int, str] | None]


def body_limits(settings: Settings, long_bodies: Iterable[str]) -> BodyLimits:
    """What the settings allow: little where the body is read by the process that answers everybody.

    long_bodies: paths whose routes stream bodies to disk, and stop at a limit of their own.
    """
    detectors = (settings.max_detector_bytes, "max_detector_bytes")
    return {
        "": (settings.max_json_bytes, "max_json_bytes"),
        **dict.fromkeys(("/detections", "/detectors"), detectors),
        **dict.fromkeys(("/dems", "/missions", "/imports", "/range-logs", *long_bodies)),
    }


class BodyLimit:
    """ASGI middleware: bodies beyond their limit are refused with 413.

    limits: (bytes, name of the setting) by path, none where a path sees to it itself; what is not there has that of "".
    """

    def __init__(self, app: ASGIApp, limits: BodyLimits, most_bytes: int) -> None:
        self._app = app
        self._limits = limits
        self._held = _Held(most_bytes)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        names = [name for name, _ in scope["headers"]]
        if b"content-length" in names and b"transfer-encoding" in names:
            # where one of them ends the body, what a proxy lets through as its rest is a request of its own to another
            answer = answer_to(NotJsonError(TWO_LENGTHS), scope["path"])
            answer.headers["Connection"] = "close"
            await answer(scope, receive, send)
            return
        body = _Body(scope, receive, self._limits.get(scope["path"], self._limits[""]), self._held)

        async def send_and_hear_out(message: Message) -> None:
            if body.awaited and message["type"] == "http.response.body" and not message.get("more_body", False):
                # all of the answer is on its way; only then is the connection closed, or has its next request
                await send({**message, "more_body": True})
                await body.hear_out()
                message = {"type": "http.response.body", "body": b"", "more_body": False}
            await send(message)

        try:
            if (refused := body.too_large) is not None:
                await answer_to(refused, scope["path"])(scope, receive, send_and_hear_out)
            else:
                await self._app(scope, body.receive, send_and_hear_out)
        finally:
            body.let_go()


class _Held:
    """Bytes of the bodies in memory, of all clients and of each."""

    def __init__(self, most_bytes: int) -> None:
        self.most_bytes = most_bytes
        self._bytes: Counter[str] = Counter()

    def take(self, client: str, number: int) -> None:
        """Raises BusyError when it is too much."""
        if not number:
            return
        self._bytes[client] += number
        if self._bytes.total() > self.most_bytes or self._bytes[client] > self.most_bytes // 4:
            raise BusyError(
                f"Bodies of {self._bytes[client]:,} bytes of this client wait already; try again in a moment",
                limit_name="max_body_memory_bytes",
                limit=self.most_bytes,
            )

    def let_go(self, client: str, number: int) -> None:
        self._bytes[client] -= number
        if not self._bytes[client]:
            del self._bytes[client]


class _Body:
    """The body of one request as it comes in."""

    def __init__(self, scope: Scope, receive: Receive, limit: tuple[int, str] | None, held: _Held) -> None:
        headers = Headers(scope=scope)
        self._receive = receive
        self._limit = limit
        self._held, self._client, self._held_bytes = held, acting_client(), 0
        self._received_bytes = 0
        told = headers.get("content-length", "0")
        self._told_bytes = int(told) if told.isdecimal() else 0
        self.awaited = told != "0" or "transfer-encoding" in headers
        # who asks before sending has not begun to send when it is refused
        self._asks_first = "100-continue" in headers.get("expect", "").lower()

    @property
    def too_large(self) -> BodyTooLargeError | None:
        """What is wrong with the length that it tells, before anything of it is read."""
        if self._limit is None or self._told_bytes <= self._limit[0]:
            return None
        return too_large(*self._limit)

    async def receive(self) -> Message:
        message = await self._next()
        if self._limit is not None and self._received_bytes > self._limit[0]:
            # FastAPI lets only its own exceptions through while it reads a body
            raise HTTPException(413) from too_large(*self._limit)
        if self._limit is not None:
            # who asks for little is not refused for what others send
            more = max(0, self._received_bytes - FREE_BYTES) - self._held_bytes
            self._held_bytes += more
            try:
                self._held.take(self._client, more)
            except BusyError as error:
                raise HTTPException(503) from error
        return message

    def let_go(self) -> None:
        """Its bytes are not in memory any more."""
        self._held.let_go(self._client, self._held_bytes)

    async def hear_out(self) -> None:
        """Read and drop what is still to come, up to a bound."""
        if self._asks_first and not self._received_bytes:
            return
        heard_bytes = self._received_bytes
        with contextlib.suppress(TimeoutError):  # who has stopped sending will read no answer later than now either
            async with asyncio.timeout(HEARD_OUT_S):
                while self.awaited and self._received_bytes - heard_bytes < HEARD_OUT_BYTES:
                    await self._next()

    async def _next(self) -> Message:
        message = await self._receive()
        self._received_bytes += len(message.get("body", b""))
        if message["type"] != "http.request" or not message.get("more_body", False):
            self.awaited = False
        return message


def too_large(max_bytes: int, limit_name: str) -> BodyTooLargeError:
    """The error for a body of more than max_bytes."""
    return BodyTooLargeError(
        f"The body is larger than the limit of {max_bytes:,} bytes", limit_name=limit_name, limit=max_bytes
    )
