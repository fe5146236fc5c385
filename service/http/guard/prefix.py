"""Behind a proxy the service may have a path of a shared name: it is taken off requests, and begins every link."""

from __future__ import annotations

import re
from urllib.parse import urlsplit, urlunsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.access.callers import ROOT
from service.settings import ROOT_PATH, Settings

from .connections import Proxies

__all__ = ["Prefix"]

HEADER = "X-Forwarded-Prefix"
GIVEN = re.compile(ROOT_PATH)


class Prefix:
    """ASGI middleware outside of everything that looks at paths, and of whatever replaces the address of a proxy.

    The path is the setting's, or what a trusted proxy says in X-Forwarded-Prefix; whether the proxy takes it off or not
    makes no difference.
    """

    def __init__(self, app: ASGIApp, settings: Settings, proxies: Proxies) -> None:
        self._app = app
        self._root = settings.root_path
        self._proxies = proxies

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        root = self._root_of(scope) if scope["type"] in ("http", "websocket") else ""
        if not root:
            await self._app(scope, receive, send)
            return
        if scope["path"] == root and scope["type"] == "http":
            # without the slash the page would look for its files beside itself
            await send({"type": "http.response.start", "status": 308, "headers": [(b"location", f"{root}/".encode())]})
            await send({"type": "http.response.body", "body": b""})
            return
        if scope["path"].startswith(f"{root}/"):
            cut = len(root.encode())
            scope = {**scope, "path": scope["path"][len(root) :], "raw_path": scope.get("raw_path", b"")[cut:]}

        async def send_with_root(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                if "location" in headers:
                    headers["location"] = _rooted_location(headers["location"], root)
            await send(message)

        before = ROOT.set(root)
        try:
            await self._app(scope, receive, send_with_root)
        finally:
            ROOT.reset(before)

    def _root_of(self, scope: Scope) -> str:
        host, _ = scope.get("client") or ("", 0)
        given = Headers(scope=scope).get(HEADER, "").rstrip("/")
        return given if GIVEN.fullmatch(given) and host in self._proxies else self._root


def _rooted_location(location: str, root: str) -> str:
    parts = urlsplit(location)
    if not parts.path.startswith("/") or parts.path.startswith(f"{root}/"):
        return location
    return urlunsplit(parts._replace(path=root + parts.path))
