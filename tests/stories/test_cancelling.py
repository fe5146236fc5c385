"""DELETE at every stage of a job: waiting, running, finished; one that runs is ended, and the next has its place."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

from tests.service.processes import has_ended
from tests.service.running import Server, running
from tests.stories.grounds import long_job, short_job, upload_rough_ground


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One worker, so that a second job has to wait for the first."""
    with running(tmp_path_factory.mktemp("cancelling") / "data", workers=1) as server:
        yield server


@pytest.fixture(scope="module")
def dem(server: Server, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return upload_rough_ground(server, tmp_path_factory.mktemp("ground"))


def posted(server: Server, request: dict[str, Any]) -> str:
    answer = server.client.post("/visibility-maps", json=request)
    assert answer.status_code == 202, answer.text
    return str(answer.headers["Location"])


def test_a_running_job_is_cancelled_and_the_next_one_has_its_place_before_it_is_done(
    server: Server, dem: dict[str, Any]
) -> None:
    running_job, waiting_job = posted(server, long_job(dem)), posted(server, short_job(dem))
    server.until(running_job, lambda job: job["progress"] > 0.0)
    assert server.client.get(waiting_job).json()["status"] == "queued"
    assert server.client.get("/health").json()["jobs"] == {"queued": 1, "running": 1}
    workers = server.workers
    answer = server.client.delete(running_job)
    assert (answer.status_code, answer.json()["status"]) == (200, "cancelled")
    assert answer.json()["problem"]["type"] == "/problems/cancelled"
    assert server.until_over(waiting_job)["status"] == "succeeded"
    # a worker that calculates to the end lives on and takes the next job; this one's was ended in the middle of it
    assert sum(map(has_ended, workers)) == 1
    assert list((server.folder / "work").iterdir()) == []


def test_a_waiting_job_is_cancelled_and_never_runs(server: Server, dem: dict[str, Any]) -> None:
    running_job, waiting_job = posted(server, long_job(dem)), posted(server, short_job(dem))
    cancelled = server.client.delete(waiting_job).json()
    assert cancelled["status"] == "cancelled"
    assert cancelled["started_at"] is None
    assert cancelled["attempts"] == 0
    server.until(running_job, lambda job: job["status"] == "running")
    assert server.client.delete(running_job).json()["status"] == "cancelled"
    assert server.client.get(waiting_job).json()["status"] == "cancelled"


def test_a_job_is_cancelled_the_moment_it_is_posted(server: Server, dem: dict[str, Any]) -> None:
    for _ in range(4):
        job = posted(server, long_job(dem))
        assert server.client.delete(job).json()["status"] == "cancelled"
    assert server.client.get("/health").json()["jobs"] == {"queued": 0, "running": 0}


def test_a_cancelled_job_has_no_layers_and_deleting_it_again_says_so_until_it_is_to_be_forgotten(
    server: Server, dem: dict[str, Any]
) -> None:
    job = posted(server, long_job(dem))
    server.client.delete(job)
    layer = server.client.get(f"{job}/layers/visible.tif")
    assert (layer.status_code, layer.json()["type"]) == (409, "/problems/not-ready")
    told = server.client.get(job).json()
    again = server.client.delete(job)
    assert (again.status_code, again.json()) == (200, told)
    assert server.client.get(job).json() == told
    assert server.client.delete(job, params={"forget": True}).status_code == 204
    assert server.client.get(job).status_code == 404
    running_job = posted(server, long_job(dem))
    assert server.client.delete(running_job, params={"forget": True}).status_code == 204
    assert server.client.get(running_job).status_code == 404


def test_deleting_a_finished_map_frees_its_files(server: Server, dem: dict[str, Any]) -> None:
    job = posted(server, short_job(dem, anchors=2))
    finished = server.until_over(job)
    results = server.folder / "results"
    before = set(results.iterdir())
    assert server.client.get(finished["layers"][0]["href"]).status_code == 200
    assert server.client.delete(job).status_code == 204
    assert len(set(results.iterdir())) == len(before) - 1


def test_a_dem_cannot_be_deleted_while_a_job_needs_it(server: Server, dem: dict[str, Any]) -> None:
    job = posted(server, long_job(dem))
    refused = server.client.delete(dem["links"]["self"])
    assert (refused.status_code, refused.json()["type"]) == (409, "/problems/in-use")
    assert server.client.delete(job).status_code == 200
    assert server.client.get(dem["links"]["self"]).status_code == 200


def test_a_client_that_waits_hears_of_the_cancellation(server: Server, dem: dict[str, Any]) -> None:
    answers = []

    def wait() -> None:
        answers.append(server.client.post("/visibility-maps", json=long_job(dem), headers={"Prefer": "wait=50"}))

    waiting = threading.Thread(target=wait)
    before = server.client.get("/visibility-maps").json()["total"]
    waiting.start()
    server.until("/visibility-maps", lambda page: page["total"] == before + 1)
    newest = server.client.get("/visibility-maps").json()["visibility_maps"][0]
    assert server.client.delete(newest["links"]["self"]).json()["status"] == "cancelled"
    waiting.join(20)
    assert answers[0].status_code == 409
    assert answers[0].json()["type"] == "/problems/cancelled"
    assert answers[0].headers["Location"] == newest["links"]["self"]


@pytest.mark.parametrize("layer", ["map.png", "min_visible_altitude.tif"])
@pytest.mark.parametrize("further_s", [0.0, 0.1, 0.4])
def test_a_map_is_deleted_while_one_of_its_layers_is_drawn(
    server: Server, dem: dict[str, Any], layer: str, further_s: float
) -> None:
    job = posted(server, short_job(dem, anchors=3))
    server.until_over(job)
    answers: list[Any] = []
    asking = threading.Thread(target=lambda: answers.append(server.client.get(f"{job}/layers/{layer}")))
    asking.start()
    while asking.is_alive() and not list((server.folder / "work").iterdir()):
        time.sleep(0.005)
    time.sleep(further_s)
    assert server.client.delete(job).status_code == 204
    asking.join()
    # drawn just in time, or gone: never a fault
    assert answers[0].status_code in (200, 404), answers[0].text
    assert server.client.get(job).status_code == 404
    assert list((server.folder / "work").iterdir()) == []
    assert server.until_over(posted(server, short_job(dem)))["status"] == "succeeded"
