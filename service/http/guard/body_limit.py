"""No request body is read beyond its limit, and a client that is refused is heard out before it is answered."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterable, Mapping

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.errors import BodyTooLargeError
from service.settings import Settings

__all__ = ["BodyLimit", "body_limits", "too_large"]

# A client still sends while it is refused. Closing on it then shows it a broken connection instead of our answer.
HEARD_OUT_BYTES = 16 * 1024 * 1024
HEARD_OUT_S = 10.0


BodyLimits = Mapping[str, tuple[int, str] | None]


def body_limits(settings: Settings, long_bodies: Iterable[str]) -> BodyLimits:
    """What the settings allow: little where the body is read by the process that answers everybody.

    long_bodies: paths whose routes stream bodies to disk, and stop at a limit of their own.
    """
    detectors = (settings.max_detector_bytes, "max_detector_bytes")
    return {
        "": (settings.max_json_bytes, "max_json_bytes"),
        **dict.fromkeys(("/detections", "/detectors"), detectors),
        **dict.fromkeys(("/dems", "/missions", "/imports", *long_bodies)),
    }


class BodyLimit:
    """ASGI middleware: bodies beyond their limit are refused with 413.

    limits: (bytes, name of the setting) by path, none where a path sees to it itself; what is not there has that of "".
    """

    def __init__(self, app: ASGIApp, limits: BodyLimits) -> None:
        self._app = app
        self._limits = limits

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        body = _Body(scope, receive, self._limits.get(scope["path"], self._limits[""]))

        async def send_when_heard_out(message: Message) -> None:
            if message["type"] == "http.response.start":
                await body.hear_out()
            await send(message)

        await self._app(scope, body.receive, send_when_heard_out)


class _Body:
    """The body of one request as it comes in."""

    def __init__(self, scope: Scope, receive: Receive, limit: tuple[int, str] | None) -> None:
        headers = Headers(scope=scope)
        self._receive = receive
        self._limit = limit
        self._received_bytes = 0
        self._awaited = headers.get("content-length", "0") != "0" or "transfer-encoding" in headers
        # who asks before sending has not begun to send when it is refused
        self._asks_first = "100-continue" in headers.get("expect", "").lower()

    async def receive(self) -> Message:
        message = await self._next()
        if self._limit is not None and self._received_bytes > self._limit[0]:
            # FastAPI lets only its own exceptions through while it reads a body
            raise HTTPException(413) from too_large(*self._limit)
        return message

    async def hear_out(self) -> None:
        """Read and drop what is still to come, up to a bound."""
        if self._asks_first and not self._received_bytes:
            return
        heard_bytes = self._received_bytes
        with contextlib.suppress(TimeoutError):  # who has stopped sending will read no answer later than now either
            async with asyncio.timeout(HEARD_OUT_S):
                while self._awaited and self._received_bytes - heard_bytes < HEARD_OUT_BYTES:
                    await self._next()

    async def _next(self) -> Message:
        message = await self._receive()
        self._received_bytes += len(message.get("body", b""))
        if message["type"] != "http.request" or not message.get("more_body", False):
            self._awaited = False
        return message


def too_large(max_bytes: int, limit_name: str) -> BodyTooLargeError:
    """The error for a body of more than max_bytes."""
    return BodyTooLargeError(
        f"The body is larger than the limit of {max_bytes:,} bytes", limit_name=limit_name, limit=max_bytes
    )
