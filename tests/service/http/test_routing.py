"""A request looks only through the routes of its own resource, and everything is found where it was."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from fastapi.routing import APIRoute
from starlette.routing import Match
from starlette.testclient import TestClient
from starlette.types import Scope

from service.http.guard.routing import Router

ASKED: list[str] = []


class Counting(APIRoute):
    def matches(self, scope: Scope) -> tuple[Match, Scope]:
        ASKED.append(self.path)
        return super().matches(scope)


def app_of(*prefixes: str) -> FastAPI:
    app = FastAPI()
    for prefix in prefixes:
        router = Router(prefix=prefix, route_class=Counting)

        @router.get("/{name}")
        async def get(name: str, prefix: str = prefix) -> dict[str, Any]:
            return {"of": prefix, "name": name}

        app.include_router(router)
    return app


def test_routes_of_others_are_not_looked_at() -> None:
    client = TestClient(app_of("/maps", "/paths", "/paths-of-others"))
    ASKED.clear()
    assert client.get("/paths/7").json()["name"] == "7"
    assert set(ASKED) == {"/paths/{name}"}
    assert client.get("/paths-of-others/7").json()["of"] == "/paths-of-others"


def test_nothing_is_found_elsewhere_and_other_methods_are_told() -> None:
    client = TestClient(app_of("/maps", "/paths"))
    assert client.get("/path/7").status_code == 404
    assert client.post("/paths/7").status_code == 405
