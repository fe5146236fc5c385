"""Logins of the page: a cookie stands for a key, for some hours and for as long as the key holds."""

from __future__ import annotations

import hashlib
import secrets
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

__all__ = ["COOKIE", "Logins"]

COOKIE = "sightline_session"
MOST_LOGINS = 10_000
MOST_OF_ONE_KEY = 50


@dataclass(frozen=True, slots=True)
class _Login:
    key_id: str
    until_s: float


class Logins:
    """Who is logged in, in memory: after a restart everybody logs in again. The oldest give way when there are many."""

    def __init__(self, lasts_s: float, clock: Callable[[], float] = time.monotonic) -> None:
        self.lasts_s = lasts_s
        self._clock = clock
        self._logins: OrderedDict[str, _Login] = OrderedDict()

    def open(self, key_id: str) -> str:
        """The cookie of a new login."""
        of_this_key = [name for name, login in self._logins.items() if login.key_id == key_id]
        for name in of_this_key[: max(0, len(of_this_key) - MOST_OF_ONE_KEY + 1)]:
            del self._logins[name]
        if len(self._logins) >= MOST_LOGINS:
            self._logins.popitem(last=False)
        cookie = secrets.token_urlsafe(32)
        self._logins[_name(cookie)] = _Login(key_id, self._clock() + self.lasts_s)
        return cookie

    def key_id(self, cookie: str) -> str | None:
        """The id of the key that the cookie stands for, while the login lasts."""
        login = self._logins.get(_name(cookie))
        return None if login is None or login.until_s <= self._clock() else login.key_id

    def close(self, cookie: str) -> None:
        """The login is over."""
        self._logins.pop(_name(cookie), None)


def _name(cookie: str) -> str:
    # looking up a hash tells nothing, by its time, of how much of a guess was right
    return hashlib.sha256(cookie.encode("utf-8", "surrogatepass")).hexdigest()
