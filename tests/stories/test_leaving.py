"""Who waits when the service ends is told so; who goes away is no fault; what may be done where is told right."""

from __future__ import annotations

import signal
import socket
import threading
import time
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.service.running import Server, running
from tests.stories.grounds import long_job, upload_rough_ground

FAULTS = ("Traceback", "ERROR")


def test_whoever_waits_at_the_end_is_told_where_the_job_goes_on(tmp_path: Path) -> None:
    answers: list[httpx.Response] = []
    with running(tmp_path / "data", workers=1) as server:
        dem = upload_rough_ground(server, tmp_path)

        def wait() -> None:
            answers.append(server.client.post("/visibility-maps", json=long_job(dem), headers={"Prefer": "wait=50"}))

        watching = threading.Event()
        events: list[str] = []

        def watch(path: str) -> None:
            with server.client.stream("GET", f"{path}/events") as told:
                for line in told.iter_lines():
                    events.append(line)
                    watching.set()

        waiting = [threading.Thread(target=wait)]
        waiting[0].start()
        page = server.until("/visibility-maps", lambda page: bool(page["visibility_maps"]))
        path = page["visibility_maps"][0]["links"]["self"]
        waiting.append(threading.Thread(target=watch, args=(path,)))
        waiting[1].start()
        # an upload that goes on and on has no result to follow
        slow = socket.create_connection((httpx.URL(server.url).host, httpx.URL(server.url).port or 80), 30.0)
        slow.sendall(b"POST /dems?filename=a.tif HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9000000\r\n\r\nII*")
        assert watching.wait(30.0)
        deadline_s = time.monotonic() + 30.0
        while not list((server.folder / "incoming").iterdir()):
            assert time.monotonic() < deadline_s, "the upload has not begun"
            time.sleep(0.02)
        assert server.stop() in (0, -signal.SIGTERM)
        for thread in waiting:
            thread.join(20)
        head, _, told = slow.recv(65536).partition(b"\r\n\r\n")
        slow.close()
    (asked,) = answers
    assert (asked.status_code, asked.json()["type"]) == (503, "/problems/stopping")
    assert asked.headers["Location"] == path
    assert int(asked.headers["Retry-After"]) > 0
    assert "event: progress" in events
    assert head.startswith(b"HTTP/1.1 503 ")
    assert b"retry-after" in head.lower()
    assert b"/problems/stopping" in told
    log = server.log.read_text()
    assert [line for line in log.splitlines() if any(fault in line for fault in FAULTS)] == []
    with running(tmp_path / "data", workers=1) as again:
        assert again.client.get(path).json()["status"] in ("queued", "running")
        again.client.delete(path)


JSON = b"Host: localhost\r\nContent-Type: application/json\r\nContent-Length: 99\r\n\r\n{"


@pytest.mark.parametrize(
    "sent",
    [
        b"POST /dems?filename=a.tif HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9000000\r\n\r\nII*",
        b"POST /visibility-maps HTTP/1.1\r\n" + JSON,
        b"POST /detections HTTP/1.1\r\n" + JSON,
    ],
)
def test_who_goes_away_while_it_sends_is_no_fault(server: Server, sent: bytes) -> None:
    url, before = httpx.URL(server.url), server.log.stat().st_size
    with socket.create_connection((url.host, url.port or 80), 30.0) as connection:
        connection.sendall(sent)
        time.sleep(0.3)
    deadline_s = time.monotonic() + 10.0
    while "POST" not in (said := server.log.read_text()[before:]):
        assert time.monotonic() < deadline_s
        time.sleep(0.05)
    assert [line for line in said.splitlines() if any(fault in line for fault in FAULTS)] == []


@pytest.mark.parametrize("path", ["/dems", "/dems/{id}", "/visibility-maps/{id}", "/missions/{id}", "/health"])
def test_what_is_allowed_is_told_and_true(server: Server, path: str) -> None:
    documented: dict[str, Any] = server.client.get("/openapi.json").json()["paths"]
    (template,) = [one for one in documented if one.replace("dem_id", "id").replace("job_id", "id").replace(
        "mission_id", "id") == path]  # fmt: skip
    answer = server.client.request("PATCH", path.replace("{id}", "0" * 32))
    assert (answer.status_code, answer.json()["type"]) == (405, "/problems/method")
    allowed = set(answer.headers["Allow"].split(", "))
    assert allowed == {method.upper() for method in documented[template]} | ({"HEAD"} if "GET" in allowed else set())
    for method in allowed:
        assert server.client.request(method, path.replace("{id}", "0" * 32)).status_code != 405
