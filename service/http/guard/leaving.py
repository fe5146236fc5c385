"""When the service ends, whoever still waits for an answer is told so, and may ask again after the next start."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.errors import StoppingError
from service.http.problems import answer_to

__all__ = ["STOPPING", "Leave", "Leaving"]

# what is nearly done is done; uvicorn's own patience ends after 3 s
PATIENCE_S = 1.5
STOPPING = "The service is stopping; ask again in a moment."


class Leave:
    """Whether the service ends, and the requests that it would cut off."""

    def __init__(self) -> None:
        self.over = False
        self.tasks: set[asyncio.Task[object]] = set()
        self.listeners: list[Callable[[], None]] = []

    def begin(self) -> None:
        """The service ends soon."""
        for listener in self.listeners:
            listener()
        asyncio.get_running_loop().call_later(PATIENCE_S, self._end)

    def _end(self) -> None:
        self.over = True
        for task in self.tasks:
            task.cancel()


class Leaving:
    """ASGI middleware: a request that is under way when the service ends gets 503 where nothing has been answered."""

    def __init__(self, app: ASGIApp, leave: Leave) -> None:
        self._app = app
        self._leave = leave

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        task = asyncio.current_task()
        if scope["type"] != "http" or task is None:
            await self._app(scope, receive, send)
            return
        begun = told_length = False

        async def send_and_note(message: Message) -> None:
            nonlocal begun, told_length
            if message["type"] == "http.response.start":
                begun = True
                told_length = any(name == b"content-length" for name, _ in message.get("headers", ()))
            await send(message)

        self._leave.tasks.add(task)
        try:
            await self._app(scope, receive, send_and_note)
        except asyncio.CancelledError:
            if not self._leave.over:
                raise
            task.uncancel()
            if not begun:
                await answer_to(StoppingError(STOPPING), scope["path"])(scope, receive, send)
            elif not told_length:
                await send({"type": "http.response.body", "body": b"", "more_body": False})
        finally:
            self._leave.tasks.discard(task)
