"""What a query has beyond what a route takes is refused, on every route; pages lead through whole lists."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from service.http.app import create_app
from service.settings import Settings
from tests.service.running import Server

NOBODY = "0" * 32


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    return create_app(Settings()).openapi()


def operations(document: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    for path, item in document["paths"].items():
        for method, operation in item.items():
            yield re.sub(r"\{\w+\}", "0", path), method, operation


def test_every_route_refuses_a_parameter_that_it_does_not_know(server: Server, document: dict[str, Any]) -> None:
    asked = list(operations(document))
    assert len(asked) > 100
    for path, method, operation in asked:
        methods = (method, "head") if method == "get" else (method,)
        for one in methods:
            answer = server.client.request(one, path, params={"colour": "red"})
            assert answer.status_code == 422, (one, path, answer.text)
        problem = server.client.request(method, path, params={"colour": "red"}).json()
        assert problem["type"] == "/problems/validation"
        assert problem["detail"].startswith("'colour' in the query is not known here, which takes "), path
        assert [error["field"] for error in problem["errors"]] == ["colour"]
        known = [one["name"] for one in operation.get("parameters", ()) if one["in"] == "query"]
        assert problem["detail"].endswith(f"takes {', '.join(sorted(known)) or 'none'}."), path


def test_a_parameter_that_is_there_twice_is_refused_unless_it_is_a_list(server: Server) -> None:
    answer = server.client.get("/dems", params=[("limit", "1"), ("limit", "2")])
    assert answer.status_code == 422
    assert answer.json()["detail"] == "The query has 'limit' 2 times; give it once."
    log = b"time_s,A,B\n0.0,10.0,20.0\n"
    query = [("filename", "log.csv"), ("anchor_id", "A"), ("anchor_id", "B")]
    assert server.client.post("/range-logs", params=query, content=log).status_code == 200


def test_a_number_of_a_query_or_path_has_digits_alone(server: Server) -> None:
    answer = server.client.get("/dems", params={"limit": "1_0"})
    assert answer.status_code == 422
    assert answer.json()["detail"] == "The query has limit '1_0', which is not a number."
    assert answer.json()["errors"] == [{"field": "limit", "detail": "is not a number"}]
    assert server.client.get("/dems", params={"limit": "10"}).status_code == 200
    answer = server.client.get(f"/visibility-maps/{NOBODY}/tiles/visible.tif/0/1_0/0")
    assert answer.status_code == 422
    assert answer.json()["detail"] == "The path has row '1_0', which is not a number."


@pytest.mark.parametrize(
    "path", ["/dems", "/missions", "/detectors", "/visibility-maps", f"/missions/{NOBODY}/versions"]
)
def test_a_cursor_that_is_none_is_told_so(server: Server, path: str) -> None:
    for cursor in ("5", "garbage", "", "1e400-" + NOBODY, "9" * 400):
        answer = server.client.get(path, params={"cursor": cursor})
        assert answer.status_code == 422
        assert answer.json()["detail"] == (
            f"The cursor {cursor[:60]!r} is none of this service: give `next` of the page before, or leave it out for "
            "the first page."
        )
    both = server.client.get(path, params={"cursor": f"1-{NOBODY}", "offset": 2})
    assert both.status_code == 422
    assert both.json()["detail"] == (
        "A page is asked for with `cursor` or with `offset`, not with both; leave out `offset`."
    )


def pages(server: Server, path: str, key: str, meanwhile: Callable[[], object]) -> list[dict[str, Any]]:
    """Every entry of a list, read two at a time while others are made."""
    entries: list[dict[str, Any]] = []
    query = {"limit": "2"}
    while True:
        page = server.client.get(path, params=query).raise_for_status().json()
        entries += page[key]
        if page["next"] is None:
            return entries
        query["cursor"] = page["next"]
        meanwhile()


def test_pages_of_missions_and_versions_lead_through_all_whatever_is_new_meanwhile(server: Server) -> None:
    def keep() -> dict[str, Any]:
        return dict(server.client.post("/missions", json={"name": "Crossing"}).raise_for_status().json())

    kept = [keep() for _ in range(5)]
    whole = server.client.get("/missions", params={"limit": 200}).json()["missions"]
    assert [one["id"] for one in whole[:5]] == [one["id"] for one in reversed(kept)]
    assert pages(server, "/missions", "missions", keep) == whole
    by_offset = server.client.get("/missions", params={"limit": 1, "offset": 7}).json()
    assert by_offset["offset"] == 7
    mission = kept[0]["links"]["self"]

    def save(number: int = 0) -> None:
        body = {"name": f"Crossing {number}"}
        server.client.put(mission, json=body, headers={"If-Match": "*"}).raise_for_status()

    for number in range(1, 5):
        save(number)
    versions = pages(server, f"{mission}/versions", "versions", save)
    assert [one["version"] for one in versions] == [5, 4, 3, 2, 1]


def test_pages_of_detectors_lead_through_all_whatever_is_new_meanwhile(server: Server) -> None:
    anchors = [{"id": "A", "east_m": 0.0, "north_m": 0.0, "altitude_m": 1.0}]
    opened = []

    def open_one() -> None:
        opened.append(server.client.post("/detectors", json={"anchors": anchors}).raise_for_status().json()["id"])

    try:
        for _ in range(4):
            open_one()
        whole = [one["id"] for one in server.client.get("/detectors", params={"limit": 200}).json()["detectors"]]
        assert set(whole[:4]) == set(opened)
        assert [one["id"] for one in pages(server, "/detectors", "detectors", open_one)] == whole
    finally:
        for id in opened:
            server.client.delete(f"/detectors/{id}")
