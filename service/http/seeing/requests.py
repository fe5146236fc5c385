"""Every request has an id, a line in the access log, and its place in the metrics."""

from __future__ import annotations

import logging
import re
import time
import uuid

from opentelemetry.trace import get_current_span
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.logs import request_id

from .metrics import Metrics

__all__ = ["ROUTINE", "Seen"]

logger = logging.getLogger("sightline.access")

HEADER = "X-Request-Id"
# what may be taken over from a proxy: nothing that could forge a line of a log
GIVEN = re.compile(r"[A-Za-z0-9._:-]{1,64}")
# asked again and again by programs that look after the service
ROUTINE = frozenset({"/live", "/ready", "/health", "/metrics"})


class Seen:
    """ASGI middleware, the outermost: whatever is answered, also by the others, is seen."""

    def __init__(self, app: ASGIApp, metrics: Metrics, access_log: bool) -> None:
        self._app = app
        self._metrics = metrics
        self._access_log = access_log

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).get(HEADER, "")
        own_id = given if GIVEN.fullmatch(given) else uuid.uuid4().hex
        token = request_id.set(own_id)
        # in the span that FastAPI has begun, where it traces (traces.py)
        get_current_span().set_attribute("sightline.request_id", own_id)
        begun_s, status, sent_bytes = time.perf_counter(), 0, 0

        async def send_with_id(message: Message) -> None:
            nonlocal status, sent_bytes
            kind = message["type"]
            if kind in ("http.response.start", "websocket.http.response.start", "websocket.accept"):
                status = message.get("status", 101)
                MutableHeaders(scope=message)[HEADER] = own_id
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
        self._metrics.answered(method, _route_of(scope), status, seconds)
        if self._access_log:
            client = scope.get("client")
            level = logging.DEBUG if scope["path"] in ROUTINE and status == 200 else logging.INFO
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
