"""Requests begin one after another, each client's in turn, and answers leave in pieces: none holds up all others."""

from __future__ import annotations

import asyncio

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.http.seeing.requests import ROUTINE
from service.jobs.sharing.turns import Turns

__all__ = ["PIECE_BYTES", "Pace"]

# As much as uvicorn holds of an answer before it waits for a client to take it; a long one whole is held whole, for
# each of the clients that ask and do not read.
PIECE_BYTES = 64 * 1024


class Pace:
    """ASGI middleware: one request begins each time the event loop comes round, beside what has begun and goes on.

    Without it hundreds that come together are all begun before the first goes on, and what looks after the service
    waits behind them; that has a lane of its own. Clients are addresses here, for keys have not been looked at yet.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self._turns, self._routine = Turns(1), Turns(1)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        if scope["type"] != "lifespan":
            turns = self._routine if scope["path"] in ROUTINE else self._turns
            host, _ = scope.get("client") or ("unknown", 0)
            await turns.acquire(host)
            # a place is held until the loop comes round, not until the answer: that may wait for workers
            asyncio.get_running_loop().call_soon(turns.release)

        async def send_in_pieces(message: Message) -> None:
            body = message.get("body", b"") if message["type"] == "http.response.body" else b""
            if len(body) > PIECE_BYTES:
                for begin in range(0, len(body) - PIECE_BYTES, PIECE_BYTES):
                    piece = body[begin : begin + PIECE_BYTES]
                    await send({"type": "http.response.body", "body": piece, "more_body": True})
                rest = len(body) % PIECE_BYTES or PIECE_BYTES
                message = {**message, "body": body[-rest:]}
            await send(message)

        await self._app(scope, receive, send_in_pieces)
