"""How many connections there may be, of all clients and of one: idle ones make room, and what is slow is ended."""

from __future__ import annotations

import errno
import ipaddress
import logging
import time
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from starlette.types import ASGIApp, Receive, Scope, Send

from service.errors import BusyError, LimitError, TooManyError
from service.http.problems import answer_to
from service.settings import Settings

__all__ = ["Connections", "Proxies", "Watched"]

logger = logging.getLogger("sightline.connections")

# Refused clients are answered, which takes connections of their own; beyond so many they are cut.
REFUSALS = 64
# Not asked for so long, this process itself was held up, and what clients sent meanwhile has not been looked at.
HELD_UP_S = 3.0
TOLD_EVERY_S = 60.0
# Of connections that come together the first have not been read from when the last are counted.
MOMENT_S = 0.5
OUT_OF_DESCRIPTORS = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})


class Proxies:
    """Addresses and networks of proxies that are believed; * is any."""

    def __init__(self, addresses: Sequence[str]) -> None:
        self._networks = _networks(addresses)

    def __contains__(self, address: str) -> bool:
        try:
            return any(ipaddress.ip_address(address) in network for network in self._networks)
        except ValueError:
            return False


class Watched(Protocol):
    """A connection."""

    @property
    def address(self) -> str:
        """Whose it is, empty where that is not known."""
        ...

    @property
    def idle_since_s(self) -> float | None:
        """On the monotonic clock; None while something is asked over it."""
        ...

    def look(self, now_s: float) -> str | None:
        """What it is too slow in, if it is."""
        ...

    def end(self, slow_in: str | None) -> None:
        """Answer what can be answered, and close; slow_in None: it is idle, and another needs its place."""
        ...

    def forget_slowness(self, now_s: float) -> None:
        """Begin to measure anew."""
        ...


class _Held:
    """The connections of one address, oldest first: over which nothing has been asked yet, and the others.

    Who has been answered comes back for more, so the silent ones go first.
    """

    def __init__(self) -> None:
        self.silent: dict[Watched, None] = {}
        self.others: dict[Watched, None] = {}

    def __len__(self) -> int:
        return len(self.silent) + len(self.others)

    def longest(self, silent_before_s: float) -> Watched | None:
        """What was never asked for anything since then, else what has been idle longest; None where neither is."""
        for one in self.silent:
            since_s = one.idle_since_s
            if since_s is not None:
                if since_s <= silent_before_s:
                    return one
                break  # the rest came later
        idle = [(since_s, one) for one in self.others if (since_s := one.idle_since_s) is not None]
        return min(idle, key=lambda each: each[0])[1] if idle else None


class Connections:
    """The open connections of one server; all of it happens in its event loop.

    Where there are as many as there may be, the address that has most makes room for a new one: of what never asked for
    anything, else of what is idle, the longest. Where it cannot, the new one is answered with 503, or 429 for an
    address that has too many. Proxies that are trusted may have as many as all.
    """

    def __init__(self, settings: Settings) -> None:
        self._most, self._most_each = settings.max_connections, settings.max_client_connections
        self._proxies = Proxies(settings.trusted_proxies)
        self._open: dict[Watched, None] = {}
        self._each: defaultdict[str, _Held] = defaultdict(_Held)
        self._looked_s = 0.0
        self._told_s = -TOLD_EVERY_S
        self.ended: Counter[str] = Counter()
        self._untold: Counter[str] = Counter()

    def __len__(self) -> int:
        return len(self._open)

    def enter(self, one: Watched) -> ASGIApp | None:
        """Take in a connection; where it cannot be, the app that answers it instead."""
        refusal: LimitError | None = None
        if self._number_of(one.address) >= self._most_each and one.address not in self._proxies:
            if not self._make_room(one.address, (one.address,)):
                refusal = TooManyError(
                    f"This address has {self._most_each} connections, as many as it may; close some",
                    limit_name="max_client_connections",
                    limit=self._most_each,
                )
        elif len(self._open) >= self._most and not self._make_room(one.address, self._by_number()):
            refusal = BusyError(
                f"{self._most} connections are open, which is the limit; try again in a moment",
                limit_name="max_connections",
                limit=self._most,
            )
        self._open[one] = self._each[one.address].silent[one] = None
        if refusal is None:
            return None
        self._count("refused")
        if len(self._open) > self._most + REFUSALS:
            one.end(None)
        return _refusing(refusal)

    def asked(self, one: Watched) -> None:
        """A request came over a connection."""
        if one in self._open and one in (mine := self._each[one.address]).silent:
            del mine.silent[one]
            mine.others[one] = None

    def become(self, one: Watched, other: Watched) -> None:
        """A connection goes on in another protocol."""
        self.leave(one)
        self._open[other] = self._each[other.address].others[other] = None

    def leave(self, one: Watched) -> None:
        """A connection is over."""
        if one in self._open:
            del self._open[one]
            mine = self._each[one.address]
            mine.silent.pop(one, None)
            mine.others.pop(one, None)
            if not mine:
                del self._each[one.address]

    def sweep(self, now_s: float) -> None:
        """End what is too slow; to be called every second."""
        held_up, self._looked_s = now_s - self._looked_s > HELD_UP_S, now_s
        for one in list(self._open):
            if held_up:
                one.forget_slowness(now_s)
            elif (slow_in := one.look(now_s)) is not None:
                self._count(slow_in)
                one.end(slow_in)
        self._tell(now_s)

    def on_fault(self, loop: Any, context: Mapping[str, Any]) -> None:
        """The event loop's handler of faults: of the thousands of lines that accept writes one is enough."""
        error = context.get("exception")
        if isinstance(error, OSError) and error.errno in OUT_OF_DESCRIPTORS and "socket.accept" in context["message"]:
            if not self._untold["out of descriptors"]:
                self._make_room("", self._by_number())
            self._count("out of descriptors")
            return
        loop.default_exception_handler(context)

    def _make_room(self, newcomer: str, addresses: Sequence[str]) -> bool:
        """Close a connection over which nothing is asked, of the first address that has one; whether there was one.

        An address that has fewer than the newcomer's gives none: those who come and go by the thousand make room among
        themselves.
        """
        now_s, few = time.monotonic(), self._number_of(newcomer)
        for address in addresses:
            number = self._number_of(address)
            if number and number >= few:
                longest = self._each[address].longest(now_s if number > few else now_s - MOMENT_S)
                if longest is not None:
                    self.leave(longest)
                    self._count("idle")
                    longest.end(None)
                    return True
        return False

    def _number_of(self, address: str) -> int:
        return len(self._each[address]) if address in self._each else 0

    def _by_number(self) -> list[str]:
        """The addresses, who has most connections first."""
        return sorted(self._each, key=lambda address: len(self._each[address]), reverse=True)

    def _count(self, what: str) -> None:
        self.ended[what] += 1
        self._untold[what] += 1

    def _tell(self, now_s: float) -> None:
        """One line a minute at most, however many there were."""
        if self._untold and now_s - self._told_s >= TOLD_EVERY_S:
            told = ", ".join(f"{number:,} {what}" for what, number in sorted(self._untold.items()))
            logger.warning("connections that were ended or refused: %s; %d are open", told, len(self._open))
            self._untold.clear()
            self._told_s = now_s


def _refusing(error: LimitError) -> ASGIApp:
    async def refuse(scope: Scope, receive: Receive, send: Send) -> None:
        answer = answer_to(error, scope["path"])
        answer.headers["Connection"] = "close"
        await answer(scope, receive, send)

    return refuse


def _networks(addresses: Sequence[str]) -> list[ipaddress.IPv4Network | ipaddress.IPv6Network]:
    """Names among them are none."""
    found: list[ipaddress.IPv4Network | ipaddress.IPv6Network] = []
    for address in addresses:
        if address == "*":
            found += [ipaddress.ip_network("0.0.0.0/0"), ipaddress.ip_network("::/0")]
            continue
        try:
            found.append(ipaddress.ip_network(address, strict=False))
        except ValueError:
            logger.warning("the trusted proxy %r is no address", address)
    return found
