"""What OpenAPI promises of versions and ranges of what is downloaded is what happens: 206, 304, 416 and ETag."""

from __future__ import annotations

from typing import Any

import pytest

from service.http.app import create_app
from service.settings import Settings
from tests.service.http.test_bad_requests import assert_problem
from tests.service.running import Server

OF_FILES = {"206", "304", "416"}


def promised() -> dict[str, tuple[dict[str, Any], bool]]:
    """The answers of each GET that promises something of it, by its path; of all products those of one, and whether
    ETag is told.
    """
    found = {}
    for path, item in create_app(Settings()).openapi()["paths"].items():
        answers = item.get("get", {"responses": {}})["responses"]
        if OF_FILES & set(answers) and (path.split("/")[2:3] != ["{job_id}"] or path.startswith("/site-maps/")):
            found[path] = answers
    return {path: (answers, "ETag" in answers["200"].get("headers", {})) for path, answers in found.items()}


PROMISED = promised()


@pytest.fixture(scope="module")
def places(server: Server) -> dict[str, str]:
    """Where what stands in braces is found."""
    dem = server.sample("valley")
    body = {"dem_id": dem["id"], "site_above_ground_m": 10.0, "max_range_m": 300.0, "sites": 0}
    sites = server.client.post("/site-maps", json=body, headers={"Prefer": "wait=60"}).json()
    mission = server.client.post("/missions", json={"name": "Crossing"}).json()
    return {
        "dem_id": dem["id"],
        "job_id": sites["id"],
        "layer": "seen.tif",
        "level": "0",
        "row": "0",
        "col": "1",
        "mission_id": mission["id"],
        "name": "mission.json",
    }


def test_promises_are_found() -> None:
    assert {path.rsplit("/", 1)[-1] for path in PROMISED} >= {"heights", "hillshade.png", "{layer}", "{level}", "{col}"}


@pytest.mark.parametrize("path", PROMISED)
def test_versions_and_ranges_are_answered_as_promised(server: Server, places: dict[str, str], path: str) -> None:
    answers, tells_etag = PROMISED[path]
    here = path.format(**places)
    whole = server.client.get(here)
    assert whole.status_code == 200, whole.text
    if "304" in answers:
        assert tells_etag, "who promises 304 tells the ETag that it takes"
        for asked in (whole.headers["ETag"], f'"other", W/{whole.headers["ETag"]}'):
            again = server.client.get(here, headers={"If-None-Match": asked})
            assert (again.status_code, again.content) == (304, b"")
            assert again.headers["ETag"] == whole.headers["ETag"]
        other = server.client.get(here, headers={"If-None-Match": '"other"'})
        assert (other.status_code, other.content) == (200, whole.content)
    part = server.client.get(here, headers={"Range": "bytes=1-2"})
    beyond = server.client.get(here, headers={"Range": "bytes=9999999999-"})
    if "416" in answers:
        assert "206" in answers
        assert (part.status_code, part.content) == (206, whole.content[1:3])
        assert_problem(beyond, 416, "range", "does not name bytes of this file")
    else:
        assert [one.content for one in (part, beyond)] == [whole.content] * 2
