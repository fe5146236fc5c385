"""Keys are asked for before anything else happens, and what each allows is all that it does."""

from __future__ import annotations

from typing import Annotated
from urllib.parse import parse_qs

from fastapi import Depends, Request
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from service.access.callers import Caller
from service.access.callers import Scope as KeyScope
from service.access.gate import Gate, is_open
from service.errors import ForbiddenError, ServiceError
from service.http.problems import answer_to

__all__ = ["Access", "CallerDep", "caller_of"]

SAFE = frozenset({"GET", "HEAD", "OPTIONS"})
FOR_OPERATORS = frozenset({"/metrics"})


class Access:
    """ASGI middleware: requests without a key that holds get 401, with one that does not allow them 403."""

    def __init__(self, app: ASGIApp, gate: Gate) -> None:
        self._app = app
        self._gate = gate

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection; routes find the caller in the request's state."""
        if scope["type"] in ("http", "websocket") and not is_open(scope["path"]):
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
            scope.setdefault("state", {})["caller"] = caller
        await self._app(scope, receive, send)


def _needed(scope: Scope) -> KeyScope:
    if scope["path"] in FOR_OPERATORS:
        return KeyScope.ADMIN
    if scope["type"] == "websocket":
        watches = parse_qs(scope["query_string"].decode("latin-1")).get("watch", ["false"])[-1]
        return KeyScope.READ if watches.lower() in ("true", "1", "yes", "on") else KeyScope.CALCULATE
    return KeyScope.READ if scope["method"] in SAFE else KeyScope.CALCULATE


def caller_of(request: Request) -> Caller:
    """Whoever sent the request."""
    caller: Caller = request.state.caller
    return caller


CallerDep = Annotated[Caller, Depends(caller_of)]
