"""No request body is read beyond its limit."""

from __future__ import annotations

from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.errors import BodyTooLargeError

__all__ = ["BodyLimit", "too_large"]


class BodyLimit:
    """ASGI middleware: bodies beyond max_bytes are refused with 413; paths in ``free`` have limits of their own."""

    def __init__(self, app: ASGIApp, max_bytes: int, free: tuple[str, ...]) -> None:
        self._app = app
        self._max_bytes = max_bytes
        self._free = free

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        if scope["type"] != "http" or scope["path"] in self._free:
            await self._app(scope, receive, send)
            return
        received_bytes = 0

        async def counting() -> Message:
            nonlocal received_bytes
            message = await receive()
            received_bytes += len(message.get("body", b""))
            if received_bytes > self._max_bytes:
                # FastAPI lets only its own exceptions through while it reads a body
                raise HTTPException(413) from too_large(self._max_bytes, "max_json_bytes")
            return message

        await self._app(scope, counting, send)


def too_large(max_bytes: int, limit_name: str) -> BodyTooLargeError:
    """The error for a body of more than max_bytes."""
    return BodyTooLargeError(
        f"The body is larger than the limit of {max_bytes:,} bytes", limit_name=limit_name, limit=max_bytes
    )
