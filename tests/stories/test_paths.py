"""Paths as a rover's team uses them: plan, follow, cancel; and four plans at once beside everybody else."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import psutil
import pytest

from tests.service.processes import left_after
from tests.service.running import Server, running

# until what has to end has ended; the plans here would go on for ten minutes
PATIENCE_S = 120.0
ENDS = {"start": {"east_m": 736484.0, "north_m": 4011317.0}, "goals": [{"east_m": 758174.0, "north_m": 4030846.0}]}
ANCHORS = [
    {"id": f"D{n}", "east_m": east_m, "north_m": north_m, "above_ground_m": 400.0}
    for n, (east_m, north_m) in enumerate([(738000, 4014500), (747300, 4027600), (756600, 4014600), (747300, 4011300)])
]


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One worker, so that a second plan has to wait for the first."""
    with running(tmp_path_factory.mktemp("paths") / "data", workers=1) as server:
        yield server


@pytest.fixture(scope="module")
def jacksboro(server: Server) -> dict[str, Any]:
    return server.sample("jacksboro")


def long_plan(dem: dict[str, Any]) -> dict[str, Any]:
    """More iterations than any machine does in the time of a test."""
    budget = {"iterations": 10_000_000, "seconds": 600.0}
    return {"dem_id": dem["id"], "anchors": ANCHORS, **ENDS, "budget": budget}


def solvers_at_work(server: Server) -> list[psutil.Process]:
    """The processes in which OMPL plans, children of the workers, once they have worked for a while.

    Workers that are just starting rehearse with short plans of their own; those are not meant.
    """
    deadline_s = time.monotonic() + 120.0
    while time.monotonic() < deadline_s:
        children = [child for worker in server.workers for child in _children(worker)]
        found = [child for child in children if _has_solved_for_s(child) > 2.0]
        if found:
            return found
        time.sleep(0.05)
    raise AssertionError("no plan came to OMPL")


def _children(worker: psutil.Process) -> list[psutil.Process]:
    try:
        return worker.children()
    except psutil.NoSuchProcess:
        return []


def _has_solved_for_s(process: psutil.Process) -> float:
    try:
        return process.cpu_times().user if "planning.paths.solving" in " ".join(process.cmdline()) else 0.0
    except psutil.NoSuchProcess:
        return 0.0


def test_a_plan_is_cancelled_while_ompl_solves_and_its_processes_are_gone(
    server: Server, jacksboro: dict[str, Any]
) -> None:
    posted = server.client.post("/paths", json=long_plan(jacksboro))
    assert posted.status_code == 202, posted.text
    where = posted.headers["Location"]
    at_work = solvers_at_work(server)
    assert server.client.get(where).json()["progress"] > 0.0
    answer = server.client.delete(where)
    assert (answer.status_code, answer.json()["status"]) == (200, "cancelled")
    assert left_after(at_work, PATIENCE_S) == []
    # the next plan gets a worker
    body = {"dem_id": jacksboro["id"], **ENDS, "budget": {"sampling": False}}
    following = server.client.post("/paths", json=body, headers={"Prefer": "wait=60"})
    assert following.json()["result"]["status"] == "found"


def test_a_plan_that_is_told_to_stop_answers_with_the_best_path_that_it_has(
    server: Server, jacksboro: dict[str, Any]
) -> None:
    where = server.client.post("/paths", json=long_plan(jacksboro)).headers["Location"]
    at_work = solvers_at_work(server)
    told = server.client.post(f"{where}/stop")
    assert (told.status_code, told.headers["Location"]) == (202, where)
    while (path := server.client.get(where).json())["status"] == "running":
        time.sleep(0.05)
    result = path["result"]
    assert (path["status"], result["status"], result["stopped_by"]) == ("succeeded", "found", "stop")
    assert result["validation"]["passed"]
    assert result["ratio"] <= 1.0 + 1e-9
    assert left_after(at_work, PATIENCE_S) == []
    assert server.client.post(f"{where}/stop").status_code == 409


def test_when_the_service_is_killed_no_solver_stays_behind(
    tmp_path_factory: pytest.TempPathFactory, jacksboro: dict[str, Any]
) -> None:
    with running(tmp_path_factory.mktemp("killed") / "data", workers=1) as server:
        dem = server.sample("jacksboro")
        server.client.post("/paths", json=long_plan(dem))
        at_work = solvers_at_work(server)
        server.kill()
        assert left_after(at_work, PATIENCE_S) == []


def test_a_plan_whose_time_is_up_says_so_and_keeps_what_it_has(server: Server, jacksboro: dict[str, Any]) -> None:
    body = {**long_plan(jacksboro), "budget": {"iterations": 10_000_000, "seconds": 12.0}}
    over = server.client.post("/paths", json=body, headers={"Prefer": "wait=60"}).json()
    result = over["result"]
    assert (result["status"], result["stopped_by"]) == ("found", "time")
    assert result["validation"]["passed"]


def test_from_a_map_over_a_path_to_the_files_that_are_driven(server: Server, jacksboro: dict[str, Any]) -> None:
    made = server.client.post(
        "/visibility-maps", json={"dem_id": jacksboro["id"], "anchors": ANCHORS}, headers={"Prefer": "wait=60"}
    ).json()
    body = {"dem_id": jacksboro["id"], "map_id": made["id"], **ENDS, "budget": {"iterations": 2000}}
    path = server.client.post("/paths", json=body, headers={"Prefer": "wait=60"}).json()
    assert path["result"]["status"] == "found"
    assert path["result"]["ratio"] <= 1.0 + 1e-9
    files = {layer["name"]: server.client.get(layer["href"]) for layer in path["layers"]}
    mission = files["path.plan"].json()["mission"]
    totals = path["result"]["totals"]
    rows = files["path.csv"].text.splitlines()
    assert len(rows) - 1 == totals["vertices"]
    assert len(mission["items"]) <= totals["vertices"]
    # the map may go; the path stays
    assert server.client.delete(made["links"]["self"]).status_code == 204
    assert server.client.get(path["links"]["self"]).json()["result"]["totals"] == totals
