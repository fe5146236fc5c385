"""The gate: whether keys are demanded, and who comes with which."""

from __future__ import annotations

import ipaddress
import logging
from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from typing import TYPE_CHECKING

from service.errors import KeysError, UnauthenticatedError
from service.settings import Settings

from .callers import LOCAL, Caller
from .keys import KeyRing
from .logins import COOKIE, Logins

if TYPE_CHECKING:
    from .tokens import Tokens

__all__ = ["Gate", "is_loopback", "is_open", "keys_file"]

logger = logging.getLogger("sightline.access")

NEEDED = (
    "This service needs a key: send it with the header 'Authorization: Bearer KEY'; in a browser, log in at /login."
)
# what tells nothing of anybody: files that everybody has, whether there is a service, and where keys are shown
OPEN = frozenset({"/", "/docs", "/live", "/login", "/logout", "/openapi.json", "/problems", "/ready"})
OPEN_BELOW = ("/page/", "/problems/")
REFUSED = "The key is not known, has expired or was revoked."


def keys_file(settings: Settings) -> Path:
    """Where the keys are."""
    return settings.data_folder / "keys.json" if settings.keys_file is None else settings.keys_file


def is_open(path: str) -> bool:
    """Whether everybody may ask for that path, with a key or without."""
    return path in OPEN or path.startswith(OPEN_BELOW)


def is_loopback(address: str) -> bool:
    """Whether only programs of this machine reach that address."""
    try:
        return ipaddress.ip_address(address.partition("%")[0]).is_loopback
    except ValueError:
        return address == "localhost"


class Gate:
    """Who may come in. Keys are demanded as soon as there are any, and off loopback always unless it is ``insecure``.

    Once they are demanded they are until the service ends, also when the last is revoked. Raises KeysError where keys
    or tokens cannot be checked.
    """

    def __init__(self, settings: Settings, *, demanded: bool = False) -> None:
        self.logins = Logins(settings.max_login_s)
        self._ring = KeyRing(keys_file(settings))
        self._tokens = _tokens(settings)
        self._demanded = demanded or self._tokens is not None

    @property
    def demands_keys(self) -> bool:
        """Whether a key is needed."""
        if not self._demanded and len(self._ring):
            logger.info("there are keys now, and they are demanded from here on")
            self._demanded = True
        return self._demanded

    def check_off_loopback(self, address: str, *, insecure: bool) -> None:
        """Demand keys off loopback, and say so aloud where none are. Raises KeysError without any."""
        if is_loopback(address) or self.demands_keys:
            return
        if not insecure:
            raise KeysError(
                f"At {address} others can reach this service, and there are no keys; make one with "
                "'sightline keys add NAME', or listen on 127.0.0.1, or let everybody in with --insecure."
            )
        logger.warning(
            "INSECURE: whoever reaches %s can read, change and delete everything here, and use this machine's "
            "processors and disk; nobody is asked for a key",
            address,
        )

    async def caller(self, headers: Mapping[str, str]) -> Caller:
        """Whoever sent a request with these headers. Raises UnauthenticatedError, ForbiddenError, KeysError."""
        if not self.demands_keys:
            return LOCAL
        scheme, _, text = headers.get("authorization", "").partition(" ")
        if scheme:
            if scheme.lower() != "bearer":
                raise UnauthenticatedError(NEEDED)
            return await self.caller_with(text.strip())
        key_id = self.logins.key_id(cookie_in(headers))
        key = None if key_id is None else self._ring.by_id(key_id)
        if key is None:
            raise UnauthenticatedError(NEEDED)
        return key.caller()

    async def caller_with(self, text: str) -> Caller:
        """Whoever comes with that key or token. Raises UnauthenticatedError, ForbiddenError, KeysError."""
        key = self._ring.find(text)
        if key is not None:
            return key.caller()
        if self._tokens is not None and text.count(".") == 2:
            return await self._tokens.caller(text)
        raise UnauthenticatedError(REFUSED)


def _tokens(settings: Settings) -> Tokens | None:
    if settings.oidc_issuer is None:
        return None
    from .tokens import Tokens  # what it stands on takes a tenth of a second, at each start of a service without

    return Tokens(settings)


def cookie_in(headers: Mapping[str, str]) -> str:
    """The cookie of a login, empty where there is none."""
    try:
        found = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return ""
    return "" if found is None else found.value
