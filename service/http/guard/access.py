"""Keys are asked for before anything else happens, and what each allows is all that it does."""

from __future__ import annotations

from dataclasses import replace
from urllib.parse import parse_qs

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from service.access.callers import CALLER, LOCAL, NOBODY
from service.access.callers import Scope as KeyScope
from service.access.gate import Gate, is_open
from service.errors import ForbiddenError, ServiceError
from service.http.problems import answer_to

__all__ = ["Access"]

SAFE = frozenset({"GET", "HEAD", "OPTIONS"})
FOR_OPERATORS = frozenset({"/about", "/metrics"})


class Access:
    """ASGI middleware: requests without a key that holds get 401, with one that does not allow them 403.

    Whoever asks is in ``CALLER`` for as long as the request is handled.
    """

    def __init__(self, app: ASGIApp, gate: Gate) -> None:
        self._app = app
        self._gate = gate

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        caller = NOBODY
        if not is_open(scope["path"]):
            try:
                caller = await self._gate.caller(Headers(scope=scope))
                needed = _needed(scope)
                if not caller.may(needed):
                    raise ForbiddenError(
                        f"The key {caller.name!r} does not have the scope {needed}, which this request needs; it has "
                        f"{', '.join(caller.scopes) or 'none'}."
                    )
            except ServiceError as error:
                await answer_to(error, scope["path"])(scope, receive, send)
                return
        if caller is LOCAL:
            host, _ = scope.get("client") or ("unknown", 0)
            caller = replace(caller, address=host)
        before = CALLER.set(caller)
        try:
            await self._app(scope, receive, send)
        finally:
            CALLER.reset(before)


def _needed(scope: Scope) -> KeyScope:
    if scope["path"] in FOR_OPERATORS:
        return KeyScope.ADMIN
    if scope["type"] == "websocket":
        watches = parse_qs(scope["query_string"].decode("latin-1")).get("watch", ["false"])[-1]
        return KeyScope.READ if watches.lower() in ("true", "1", "yes", "on") else KeyScope.CALCULATE
    return KeyScope.READ if scope["method"] in SAFE else KeyScope.CALCULATE
