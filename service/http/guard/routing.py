"""Routers of resources: each is looked through only for paths of its own, for there are hundreds of routes."""

from __future__ import annotations

from fastapi import APIRouter
from starlette._utils import get_route_path
from starlette.routing import Match
from starlette.types import Scope

__all__ = ["Router"]


class Router(APIRouter):
    """FastAPI's router, which is asked about every path: one that does not begin as its own is none of its."""

    def matches(self, scope: Scope) -> tuple[Match, Scope]:
        """Whether one of its routes has the path of a request."""
        if not get_route_path(scope).startswith(self.prefix):
            return Match.NONE, {}
        return super().matches(scope)
