"""A planner places drones over HTTP: follows the search, takes the best so far, and has a cluster help."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from distributed import LocalCluster

from tests.service.running import Server, running

# sockets and loops that distributed closes only as the interpreter ends
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")


@pytest.fixture(scope="module")
def cluster() -> Iterator[LocalCluster]:
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0", host="127.0.0.1"
    ) as started:
        yield started


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory, cluster: LocalCluster) -> Iterator[Server]:
    """One worker, so that a second job has to wait for the first, and a cluster beside it."""
    folder = tmp_path_factory.mktemp("placing") / "data"
    with running(folder, workers=1, dask_scheduler=cluster.scheduler_address) as server:
        yield server


@pytest.fixture(scope="module")
def dem(server: Server) -> dict[str, Any]:
    return server.sample("jacksboro")


def request(dem: dict[str, Any], candidates: int, **more: Any) -> dict[str, Any]:
    bounds = dem["bounds_of_posts_m"]
    area_m2 = (bounds["east"] - bounds["west"]) * (bounds["north"] - bounds["south"])
    spacing_m = (area_m2 / candidates) ** 0.5
    return {
        "dem_id": dem["id"],
        "count": 4,
        "candidates": [{"spacing_m": spacing_m, "above_ground_m": [80.0]}],
        "goal": {"objective": "dop", "min_anchors": 3},
        **more,
    }


def posted(server: Server, asked: dict[str, Any]) -> str:
    answer = server.client.post("/placements", json=asked)
    assert answer.status_code == 202, answer.text
    return str(answer.headers["Location"])


def places(job: dict[str, Any]) -> list[list[float]]:
    return [[one["east_m"], one["north_m"], one["altitude_m"]] for one in job["result"]["placed"]]


def test_a_search_that_is_stopped_answers_with_the_best_so_far(server: Server, dem: dict[str, Any]) -> None:
    job = posted(server, request(dem, 15_000))
    waiting = posted(server, request(dem, 20))
    refused = server.client.post(f"{waiting}/stop")
    assert (refused.status_code, refused.json()["type"]) == (409, "/problems/not-ready")
    assert "DELETE cancels it" in refused.json()["detail"]
    followed = server.until(job, lambda told: told["progress"] > 0.02)
    assert followed["status"] == "running"
    told = server.client.post(f"{job}/stop")
    assert (told.status_code, told.headers["Location"]) == (202, job)
    over = server.until_over(job)
    assert over["status"] == "succeeded"
    assert over["result"]["stopped"]
    assert len(over["result"]["placed"]) == 4
    assert 0.0 <= over["result"]["value_share"] <= over["result"]["bound_share"]
    assert server.client.get(over["layers"][0]["href"]).status_code == 200
    assert not server.until_over(waiting)["result"]["stopped"]
    refused = server.client.post(f"{job}/stop")
    assert refused.status_code == 409
    assert "succeeded" in refused.json()["detail"]
    assert server.client.post("/placements/none/stop").status_code == 404


def test_a_cluster_gives_the_same_answer(server: Server, dem: dict[str, Any]) -> None:
    here, there = (posted(server, request(dem, 60, run_on=where)) for where in ("here", "cluster"))
    one, other = server.until_over(here), server.until_over(there)
    assert other["status"] == "succeeded", other
    assert np.array_equal(places(one), places(other))
    assert one["result"]["value_share"] == other["result"]["value_share"]
    assert other["result"]["parameters"]["run_on"] == "cluster"


def test_a_cluster_that_went_away_is_told_in_a_sentence(
    server: Server, dem: dict[str, Any], cluster: LocalCluster
) -> None:
    cluster.close()
    failed = server.until_over(posted(server, request(dem, 20, run_on="cluster")))
    assert failed["status"] == "failed"
    assert (failed["problem"]["status"], failed["problem"]["type"]) == (503, "/problems/cluster")
    assert "No Dask scheduler answers" in failed["problem"]["detail"]
