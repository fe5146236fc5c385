"""Whoever asks: a tenant, a name, and scopes."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum

__all__ = ["DEFAULT_TENANT", "LOCAL", "TENANT", "Caller", "Scope"]

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

    key_id: of the key that it came with, empty where it came without one.
    """

    tenant: str
    name: str
    scopes: tuple[Scope, ...]
    key_id: str = ""

    def may(self, needed: Scope) -> bool:
        """Whether one of its scopes is enough."""
        return any(scope.allows(needed) for scope in self.scopes)


# whoever asks a service that demands no keys
LOCAL = Caller(DEFAULT_TENANT, "local", tuple(Scope))
