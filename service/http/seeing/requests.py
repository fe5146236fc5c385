"""Every request has an id, a line in the access log, and its place in the metrics."""

from __future__ import annotations

import itertools
import logging
import re
import secrets
import time

from opentelemetry.trace import get_current_span
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.logs import request_id

from .metrics import Metrics

__all__ = ["ROUTINE", "Seen"]

logger = logging.getLogger("sightline.access")

HEADER = b"x-request-id"
# ids are told apart, not kept secret: to ask the system for chance at every request costs more than all else here
OF_THIS_PROCESS, NUMBERS = secrets.token_hex(8), itertools.count(1)
STARTS = frozenset({"http.response.start", "websocket.http.response.start", "websocket.accept"})
# what may be taken over from a proxy: nothing that could forge a line of a log
GIVEN = re.compile(r"[A-Za-z0-9._:-]{1,64}")
# others are words that clients make up, and would make series without end
METHODS = frozenset({"DELETE", "GET", "HEAD", "OPTIONS", "PATCH", "POST", "PUT", "WEBSOCKET"})
# asked again and again by programs that look after the service
ROUTINE = frozenset({"/live", "/ready", "/health", "/metrics"})


class Seen:
    """ASGI middleware, the outermost: whatever is answered, also by the others, is seen.

    It is in the way of every epoch and every map, so it goes about headers and records with little.
    """

    def __init__(self, app: ASGIApp, metrics: Metrics, access_log: bool, traced: bool) -> None:
        self._app = app
        self._metrics = metrics
        self._access_log = access_log
        self._traced = traced

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        given = next((value for name, value in scope["headers"] if name == HEADER), b"").decode("latin-1")
        own_id = given if GIVEN.fullmatch(given) else f"{OF_THIS_PROCESS}{next(NUMBERS):016x}"
        token = request_id.set(own_id)
        if self._traced:  # in the span that FastAPI has begun (traces.py)
            get_current_span().set_attribute("sightline.request_id", own_id)
        begun_s, status, sent_bytes = time.perf_counter(), 0, 0

        async def send_with_id(message: Message) -> None:
            nonlocal status, sent_bytes
            kind = message["type"]
            if kind in STARTS:
                status = message.get("status", 101)
                message["headers"] = [*message.get("headers", ()), (HEADER, own_id.encode())]
            elif kind == "http.response.body":
                sent_bytes += len(message.get("body", b""))
            await send(message)

        try:
            await self._app(scope, receive, send_with_id)
        finally:
            self._tell(scope, status, time.perf_counter() - begun_s, sent_bytes)
            request_id.reset(token)

    def _tell(self, scope: Scope, status: int, seconds: float, sent_bytes: int) -> None:
        """status: 0 when the client went away before an answer."""
        method = scope.get("method", "WEBSOCKET")
        self._metrics.answered(method if method in METHODS else "other", _route_of(scope), status, seconds)
        level = logging.DEBUG if scope["path"] in ROUTINE and status == 200 else logging.INFO
        if self._access_log and logger.isEnabledFor(level):
            client = scope.get("client")
            logger.log(
                level,
                "%s %s %d",
                *(method, scope["path"], status),
                extra={
                    "method": method,
                    "path": scope["path"],
                    "status": status,
                    "seconds": round(seconds, 4),
                    "bytes": sent_bytes,
                    "client": client[0] if client else None,
                },
            )


def _route_of(scope: Scope) -> str:
    """The route as documented, so that ids make no series of their own; what has none counts together."""
    path = getattr(scope.get("route"), "path", None)
    return str(path) if path is not None else "other"
