"""Whoever asks: a tenant, a name, and scopes."""

from __future__ import annotations

import re
from contextvars import ContextVar
from dataclasses import dataclass
from enum import StrEnum

__all__ = [
    "CALLER",
    "DEFAULT_TENANT",
    "LOCAL",
    "NOBODY",
    "ROOT",
    "TENANT",
    "Caller",
    "Scope",
    "acting_client",
    "acting_tenant",
    "rooted",
    "seen_tenant",
]

DEFAULT_TENANT = "default"
TENANT = re.compile(r"[a-z0-9][a-z0-9._-]{0,62}")


class Scope(StrEnum):
    """What a key allows; each allows what stands before it too."""

    READ = "read"
    CALCULATE = "calculate"
    ADMIN = "admin"

    def allows(self, needed: Scope) -> bool:
        """Whether it is enough."""
        order = tuple(Scope)
        return order.index(self) >= order.index(needed)


@dataclass(frozen=True, slots=True)
class Caller:
    """Whose the request is, under which name, and what it may do.

    key_id: of the key that it came with, empty where it came without one. address: where no keys are demanded, whence.
    """

    tenant: str
    name: str
    scopes: tuple[Scope, ...]
    key_id: str = ""
    address: str = ""

    def may(self, needed: Scope) -> bool:
        """Whether one of its scopes is enough."""
        return any(scope.allows(needed) for scope in self.scopes)


# whoever asks a service that demands no keys
LOCAL = Caller(DEFAULT_TENANT, "local", tuple(Scope))
# whoever asks without a key for what is open to all
NOBODY = Caller("", "nobody", ())
# Whose request is being handled. What keeps things looks here, so that no route can forget to ask whose they are;
# where no request is handled (at the start, in jobs, at the command line) it is None, and everything is seen.
CALLER: ContextVar[Caller | None] = ContextVar("caller", default=None)


# Under which path of a proxy's name the request came (``/sightline`` of example.org/sightline), empty for none.
ROOT: ContextVar[str] = ContextVar("root", default="")


def rooted(path: str) -> str:
    """The path by which whoever asks finds what has this one here."""
    return ROOT.get() + path


def seen_tenant() -> str | None:
    """The tenant whose things may be seen now; None: those of all."""
    caller = CALLER.get()
    return None if caller is None else caller.tenant


def acting_client() -> str:
    """Among whom work is shared out now: tenants, or addresses where no keys are demanded; empty for no request."""
    caller = CALLER.get()
    return "" if caller is None else caller.address or caller.tenant


def acting_tenant() -> str:
    """The tenant whose is what is made now."""
    return seen_tenant() or DEFAULT_TENANT
