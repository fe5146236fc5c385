"""Behind a proxy the service may be under a path of a shared name: links, the page, cookies and streams follow."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.sync.client import connect

from benchmarks.service.slow_clients import made_place
from service.access.callers import Scope
from service.access.keys import add_key
from service.jobs.marker import claimed
from tests.service.running import Server, running
from tests.stories.forwarding import forwarding

PLACES = {"strips": ("/tools/sightline", True), "keeps": ("/sightline", False)}


@pytest.fixture(scope="module", params=PLACES)
def behind(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Server, str]]:
    """The service and its address at the proxy, which takes its path off requests, or leaves it on."""
    root, strips = PLACES[request.param]
    folder = tmp_path_factory.mktemp("path") / "data"
    settings: dict[str, Any] = {} if strips else {"root_path": root}
    with running(folder, rehearse="maps", **settings) as server, forwarding(server.url, root, strips) as port:
        yield server, f"http://127.0.0.1:{port}{root}"


def paths_in(told: Any) -> Iterator[str]:
    """Whatever in an answer is a path of the service's own, but the names of kinds of problems."""
    if isinstance(told, dict):
        for name, value in told.items():
            if name != "type":
                yield from paths_in(value)
    elif isinstance(told, list):
        for value in told:
            yield from paths_in(value)
    elif isinstance(told, str) and re.fullmatch(r"/[a-z?].*", told):
        yield told


def test_every_link_of_every_answer_leads_through_the_proxy(behind: tuple[Server, str]) -> None:
    _, base = behind
    root = httpx.URL(base).path
    with httpx.Client(base_url=base, timeout=120.0, trust_env=False) as client:
        place = made_place(client)
        made = client.post(
            "/visibility-maps",
            json={"dem_id": place.dem["id"], "anchors": place.map["request"]["anchors"]},
            headers={"Prefer": "wait=60"},
        )
        assert made.headers["Location"] == made.json()["links"]["self"] == f"{root}/visibility-maps/{made.json()['id']}"
        mission = client.post("/missions", json={"name": "under a path"}).json()
        levels = client.get(f"/dems/{place.dem['id']}/levels").json()
        detector = client.get(f"/detectors/{place.detector_id}").json()
        listed = client.get("/visibility-maps").json()
        origin = httpx.URL(base).copy_with(path="/")
        seen = 0
        for path in {*paths_in([place.dem, made.json(), mission, levels, detector, listed])}:
            assert path.startswith(f"{root}/"), path
            if path.endswith(("/stream", "/epochs", "/restore")):
                continue
            # of a mission without ground there are no files yet
            assert client.get(origin.join(path)).status_code in ((200, 409) if "/files/" in path else (200,)), path
            seen += 1
        assert seen > 20
        assert client.get("/openapi.json").json()["servers"] == [{"url": root}]


def test_the_page_and_the_reference_load_their_files(behind: tuple[Server, str]) -> None:
    _, base = behind
    with httpx.Client(trust_env=False, follow_redirects=True) as client:
        for document in (base, f"{base}/", f"{base}/docs"):
            page = client.get(document)
            assert page.status_code == 200
            files = re.findall(r'(?:src|href)="(/[^"]+)"', page.text)
            assert files
            for file in files:
                assert client.get(page.url.join(file)).status_code == 200, file


def test_a_stream_opens_through_the_proxy(behind: tuple[Server, str]) -> None:
    _, base = behind
    with httpx.Client(base_url=base, timeout=120.0, trust_env=False) as client:
        place = made_place(client)
        url = httpx.URL(base).copy_with(scheme="ws", path=client.get(f"/detectors/{place.detector_id}").json()[
            "links"]["stream"])  # fmt: skip
    with connect(str(url), proxy=None) as stream:
        stream.send("no epoch")
        assert json.loads(stream.recv(10.0))["problem"]["status"] == 400


def test_a_login_stays_under_the_path(tmp_path: Path) -> None:
    folder = claimed(tmp_path / "data")
    text = add_key(folder / "keys.json", "ada", "default", (Scope.CALCULATE,))[1]
    root = "/sightline"
    with (
        running(folder, rehearse="maps") as server,
        forwarding(server.url, root, True) as port,
        httpx.Client(base_url=f"http://127.0.0.1:{port}{root}", timeout=60.0, trust_env=False) as client,
    ):
        assert f'action="{root}/login"' in client.get("/login").text
        told = client.post("/login", data={"key": text})
        assert (told.status_code, told.headers["Location"]) == (303, f"{root}/")
        assert f"Path={root}/" in told.headers["Set-Cookie"]
        assert client.get("/dems").status_code == 200


def test_who_is_no_proxy_is_not_believed(behind: tuple[Server, str]) -> None:
    server, _ = behind
    transport = httpx.HTTPTransport(local_address="127.0.0.8")
    with httpx.Client(base_url=server.url, transport=transport, trust_env=False) as client:
        told = client.get("/openapi.json", headers={"X-Forwarded-Prefix": "/elsewhere"}).json()
        assert "/elsewhere" not in json.dumps(told.get("servers", []))
