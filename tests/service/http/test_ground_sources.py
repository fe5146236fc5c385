"""DEMs made from a remote source over HTTP: followed to the end, and what becomes of servers that fail or lie."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from typing import Any

import pytest

from tests.service.ground.range_server import RangeServer, serving
from tests.service.ground.test_remote import write_cell
from tests.service.running import Server, running

AREA = {"lon_deg": -84.3, "lat_deg": 36.4, "radius_m": 2000.0}
SOURCE = "glo-90"


@pytest.fixture(scope="module")
def remote(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RangeServer]:
    folder = tmp_path_factory.mktemp("remote")
    write_cell(folder, -85, 36)
    with serving(folder) as server:
        yield server


@pytest.fixture(scope="module")
def service(remote: RangeServer, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    sources = json.dumps({SOURCE: {"base": remote.url, "scheme": "copernicus-glo-90"}})
    with running(tmp_path_factory.mktemp("sources") / "data", workers=1, ground_sources=sources) as server:
        yield server


def outcome(server: Server, **body: Any) -> Any:
    """What following a request for ground ends with."""
    asked = server.client.post("/dems", json={"source": SOURCE, **body})
    assert asked.status_code == 202, asked.text
    until = time.monotonic() + 60.0
    answer = server.client.get(asked.headers["Location"])
    while answer.status_code == 202 and time.monotonic() < until:
        time.sleep(0.05)
        answer = server.client.get(asked.headers["Location"])
    return answer


@pytest.mark.parametrize(
    ("how", "sentence"),
    [
        ("html", "answers with a web page"),
        ("redirect", "redirects elsewhere"),
        ("no_ranges", "gives no parts of files"),
        ("short", "were promised"),
        ("elsewhere", "gives another part of the file"),
    ],
)
def test_a_server_that_lies_is_a_bad_gateway(service: Server, remote: RangeServer, how: str, sentence: str) -> None:
    remote.how = how
    try:
        answer = outcome(service, area=AREA)
    finally:
        remote.how = "well"
    assert (answer.status_code, answer.json()["type"]) == (502, "/problems/ground-source"), answer.text
    assert sentence in answer.json()["detail"]


def test_it_is_made_once_the_server_does_well_and_serves_without_it(service: Server, remote: RangeServer) -> None:
    answer = outcome(service, area=AREA)
    assert (answer.status_code, answer.json()["heights_count_from"]) == (200, "sea level"), answer.text
    remote.how = "error"
    try:
        within = outcome(service, area={**AREA, "radius_m": 1000.0})
    finally:
        remote.how = "well"
    assert within.status_code == 200, within.text


def test_where_the_source_has_nothing_it_says_so(service: Server) -> None:
    answer = outcome(service, area={**AREA, "lon_deg": 10.5})
    assert (answer.status_code, answer.json()["type"]) == (422, "/problems/no-ground"), answer.text


def test_a_source_that_nobody_listed_is_refused_at_once(service: Server, remote: RangeServer) -> None:
    answer = service.client.post("/dems", json={"area": AREA, "source": remote.url})
    assert (answer.status_code, "the operator lists: glo-90" in answer.json()["detail"]) == (422, True), answer.text
