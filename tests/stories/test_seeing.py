"""What an operator sees: request ids in answers and in the log, jobs as they begin and end, metrics, a failed start."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from prometheus_client.parser import text_string_to_metric_families

from tests.service.running import Server, environment, running
from tests.stories.grounds import short_job


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with running(tmp_path_factory.mktemp("seeing") / "data", log_format="json", rehearse="maps") as server:
        yield server


def lines(server: Server) -> list[dict[str, Any]]:
    return [json.loads(line) for line in server.said]


def said_of(server: Server, request_id: str, wanted: set[str]) -> dict[str, dict[str, Any]]:
    """The lines of a request by their messages; the last is written once the answer is on its way."""
    deadline_s = time.monotonic() + 20.0
    while True:
        said = {line["message"]: line for line in lines(server) if line.get("request_id") == request_id}
        if wanted <= said.keys():
            return said
        assert time.monotonic() < deadline_s, said.keys()
        time.sleep(0.05)


def metric(server: Server, name: str, **labels: str) -> float:
    text = server.client.get("/metrics").text
    found = [
        sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
        if sample.name == name and labels.items() <= sample.labels.items()
    ]
    return sum(found)


def test_a_request_id_comes_back_and_is_in_every_line_of_its_request_and_job(server: Server) -> None:
    dem = server.sample("valley")
    asked = {"X-Request-Id": "from-the-proxy.7", "Prefer": "wait=60"}
    answer = server.client.post("/visibility-maps", json=short_job(dem), headers=asked)
    assert (answer.status_code, answer.headers["X-Request-Id"]) == (201, "from-the-proxy.7")
    messages = said_of(server, "from-the-proxy.7", {"job begins", "job is over", "POST /visibility-maps 201"})
    job_id = answer.json()["id"]
    begins, over = messages["job begins"], messages["job is over"]
    assert (begins["job"], begins["kind"], begins["attempt"]) == (job_id, "visibility-map", 1)
    assert (over["job"], over["status"]) == (job_id, "succeeded")
    assert over["ran_s"] >= 0.0
    access = messages["POST /visibility-maps 201"]
    assert (access["logger"], access["status"], access["method"]) == ("sightline.access", 201, "POST")
    assert access["seconds"] >= over["ran_s"]


@pytest.mark.parametrize("forged", ['a"b', "a b", "x" * 65, ""])
def test_an_id_that_could_forge_a_line_is_replaced(server: Server, forged: str) -> None:
    told = server.client.get("/dems", headers={"X-Request-Id": forged}).headers["X-Request-Id"]
    assert told != forged
    assert len(told) == 32


def test_a_refusal_has_an_id_too(server: Server) -> None:
    assert server.client.get("/nowhere").headers["X-Request-Id"]
    assert server.client.get("/dems", headers={"Host": "elsewhere.example"}).headers["X-Request-Id"]


def test_metrics_count_requests_jobs_and_what_there_is(server: Server) -> None:
    dem = server.sample("valley")
    before = metric(server, "sightline_jobs_over_total", kind="visibility-map", status="succeeded")
    for anchors in (2, 3):
        server.client.post("/visibility-maps", json=short_job(dem, anchors), headers={"Prefer": "wait=60"})
    assert metric(server, "sightline_jobs_over_total", kind="visibility-map", status="succeeded") == before + 2
    assert metric(server, "sightline_job_seconds_count", kind="visibility-map") == before + 2
    assert metric(server, "sightline_http_requests_total", route="/visibility-maps", method="POST") >= 2
    server.client.get("/dems/unknown")
    assert metric(server, "sightline_http_requests_total", route="/dems/{dem_id}", status="404") >= 1
    assert metric(server, "sightline_memory_resident_bytes", process="workers") > 50e6
    assert metric(server, "sightline_store_bytes") >= (server.folder / "sightline.sqlite3").stat().st_size
    assert metric(server, "sightline_workers_wanted") == server.client.get("/health").json()["workers"]["wanted"]
    assert metric(server, "sightline_queue_length") == 0.0
    opened = server.client.post(
        "/detectors", json={"anchors": [{"id": f"A{i}", "east_m": i, "north_m": 2 * i, "up_m": 0} for i in range(4)]}
    )
    assert metric(server, "sightline_detector_sessions") == float(opened.status_code == 201)


def test_methods_that_clients_make_up_count_as_one(server: Server) -> None:
    for number in range(20):
        assert server.client.request(f"MADEUP{number}", "/dems").status_code == 405
    assert "MADEUP" not in server.client.get("/metrics").text
    assert metric(server, "sightline_http_requests_total", method="other") == 20


def test_live_and_ready_are_told_and_do_not_fill_the_log(server: Server) -> None:
    assert server.client.get("/live").json() == {"status": "alive"}
    assert server.client.get("/ready").json() == {"status": "ready"}
    assert [line for line in lines(server) if line.get("path") in ("/live", "/ready") and line["status"] == 200] == []


FAILING = """
import service.jobs.supervisor as supervisor
def fail(*_):
    raise OSError("the disk burns")
supervisor.recover = fail
from service.cli import main
main()
"""


def test_a_start_that_fails_ends_at_once_with_exit_code_1(tmp_path: Path) -> None:
    begun_s = time.monotonic()
    ended = subprocess.run(
        [sys.executable, "-c", FAILING, "serve"],
        env=environment(tmp_path / "data", rehearse="maps"),
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert ended.returncode == 1
    assert "listens" not in ended.stdout
    assert "the disk burns" in ended.stderr
    assert ended.stderr.rstrip().endswith("The service could not start; its log tells why.")
    assert time.monotonic() - begun_s < 60.0
