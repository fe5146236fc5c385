"""Web pages of elsewhere cannot use the service: hosts and origins are checked, and every answer says what it is."""

from __future__ import annotations

import ipaddress
import re
from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.errors import AccessError, HostError, MediaTypeError, OriginError
from service.http.problems import answer_to
from service.http.web_page import SAID_OF_EVERY_ANSWER
from service.settings import Settings

__all__ = ["Browsers"]

SAFE = frozenset({"GET", "HEAD", "OPTIONS"})
HOST = re.compile(r"(\[[^\]]*\]|[^:\s]*)(?::\d*)?")
DEFAULT_PORTS = {"http": 80, "https": 443}
SAID = [(name.lower().encode(), value.encode()) for name, value in SAID_OF_EVERY_ANSWER.items()]
# Of two the one that is looked at here need not be the one that somebody else, a proxy or the app, goes by.
ONCE = {b"host": HostError, b"origin": OriginError, b"content-type": MediaTypeError}


class Browsers:
    """ASGI middleware: requests for other hosts (421) and from other origins (403) are refused.

    A browser tells where a request comes from, in Origin and Sec-Fetch-Site, and pages cannot change that; programs
    send neither and see no difference. A name that somebody else's server points at our address is not ours: bare
    addresses, localhost and the names of the settings are.
    """

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._hosts = tuple(name.lower() for name in (*settings.allowed_hosts, settings.host))
        self._origins = frozenset(origin.rstrip("/").lower() for origin in settings.allowed_origins)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one connection."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return

        async def send_with_policy(message: Message) -> None:
            if message["type"] in ("http.response.start", "websocket.http.response.start"):
                said = message.get("headers", ())
                names = {name for name, _ in said}
                message["headers"] = [*said, *(pair for pair in SAID if pair[0] not in names)]
            await send(message)

        try:
            self._check(scope)
        except (AccessError, MediaTypeError) as error:
            await answer_to(error, scope["path"])(scope, receive, send_with_policy)
            return
        await self._app(scope, receive, send_with_policy)

    def _check(self, scope: Scope) -> None:
        """Raises HostError, OriginError, MediaTypeError."""
        names = [name for name, _ in scope["headers"]]
        for name, error in ONCE.items():
            if names.count(name) > 1:
                raise error(f"The request has the header {name.decode()!r} {names.count(name)} times; send it once.")
        headers = Headers(scope=scope)
        host = headers.get("host")
        if host is not None and not self._is_ours(host):
            raise HostError(
                f"This service does not answer for {host[:80]!r}; ask it by its address, or let its operator add the "
                "name (setting SIGHTLINE_ALLOWED_HOSTS)."
            )
        origin, site = headers.get("origin"), headers.get("sec-fetch-site")
        if origin is not None and origin.lower() in self._origins:
            return
        changes = scope["type"] == "websocket" or scope["method"] not in SAFE
        if changes and origin is not None and not _is_same(origin, host):
            raise OriginError(
                f"Web pages of {origin[:80]!r} may not use this service; its operator can let them (setting "
                "SIGHTLINE_ALLOWED_ORIGINS)."
            )
        # who follows a link from elsewhere may look, but no page elsewhere may have its browser fetch things
        followed = not changes and headers.get("sec-fetch-mode") == "navigate"
        if site in ("cross-site", "same-site") and not followed and not (scope.get("method") == "OPTIONS"):
            raise OriginError(
                "Web pages of elsewhere may not use this service; its operator can let them (setting "
                "SIGHTLINE_ALLOWED_ORIGINS)."
            )
        from_page = origin is not None or site is not None
        has_body = headers.get("content-length", "0") != "0" or "transfer-encoding" in headers
        if changes and from_page and has_body and not headers.get("content-type"):
            raise MediaTypeError("The body must say what it is, with the header 'Content-Type'.")

    def _is_ours(self, host: str) -> bool:
        name = _name_of(host)
        try:
            ipaddress.ip_address(name.strip("[]").partition("%")[0])
        except ValueError:
            known = ("localhost", "*.localhost", *self._hosts)
            return any(one in ("*", name) or (one.startswith("*.") and name.endswith(one[1:])) for one in known)
        return True


def _name_of(host: str) -> str:
    """The name in a Host header, without port; empty where it is none."""
    said = HOST.fullmatch(host.strip().lower())
    return "" if said is None else said[1].rstrip(".")


def _is_same(origin: str, host: str | None) -> bool:
    """Whether a page of that origin came from that host. Schemes are not compared: a proxy speaks TLS."""
    try:
        said = urlsplit(origin)
        port = said.port or DEFAULT_PORTS.get(said.scheme)
        ours = urlsplit(f"{said.scheme}://{host or ''}")
        return (
            said.scheme in DEFAULT_PORTS
            and said.hostname is not None
            and (said.hostname, port) == (ours.hostname, ours.port or DEFAULT_PORTS[said.scheme])
        )
    except ValueError:
        return False
