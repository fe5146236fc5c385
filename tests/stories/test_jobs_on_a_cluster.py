"""Every job is calculated on a Dask cluster of two workers: the same results, followed, cancelled, and none lost."""

from __future__ import annotations

import os
import re
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
from distributed import LocalCluster

from service.ground.coverage import LIBRARY
from service.products import Product
from service.products.registry import PRODUCTS
from terrain import GroundLibrary, index_ground, write_npz
from terrain.tiles.library import edited
from tests.service.asked import ASKED
from tests.service.large_dems import anchors, hills_m, write_cog
from tests.service.processes import has_ended
from tests.service.running import Server, running
from tests.service.small_maps import small_grid
from tests.stories.grounds import long_job, short_job, upload_rough_ground
from tests.stories.test_placing import posted, request

# sockets and loops that distributed closes only as the interpreter ends
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
WITHIN_S = 6.0


def machines() -> LocalCluster:
    """Two Dask workers, each a process of its own that is started again when it dies, as on two machines."""
    address = {"dashboard_address": "127.0.0.1:0", "host": "127.0.0.1"}
    return LocalCluster(n_workers=2, threads_per_worker=1, processes=True, memory_limit="3GiB", **address)


@pytest.fixture(scope="module")
def cluster() -> Iterator[LocalCluster]:
    with machines() as started:
        yield started


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory, cluster: LocalCluster) -> Iterator[Server]:
    folder = tmp_path_factory.mktemp("cluster") / "data"
    where = {"dask_scheduler": cluster.scheduler_address, "calculate_on": "cluster", "workers": 2, "rehearse": "maps"}
    with running(folder, **where) as server:
        yield server


@pytest.fixture(scope="module")
def ground(server: Server, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    path = tmp_path_factory.mktemp("ground") / "small.npz"
    write_npz(small_grid(), path)
    return server.upload(path, vertical_datum="EGM96")


@pytest.fixture(scope="module")
def rough(server: Server, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return upload_rough_ground(server, tmp_path_factory.mktemp("rough"))


def calculating() -> list[psutil.Process]:
    """Sightline's processes that a Dask worker of ours started."""
    return [one for one in psutil.Process().children(recursive=True) if is_at_work(one)]


def is_at_work(process: psutil.Process) -> bool:
    try:
        # a zombie's command line is empty
        parent = process.parent()
        return "service.jobs.worker" in process.cmdline() and parent is not None and "serve" not in parent.cmdline()
    except psutil.NoSuchProcess:
        return False


def computes(process: psutil.Process) -> bool:
    try:
        return process.cpu_percent(0.1) > 50.0
    except psutil.NoSuchProcess:
        return False


def until(holds: Callable[[], bool], within_s: float = WITHIN_S) -> None:
    deadline_s = time.monotonic() + within_s
    while not holds():
        assert time.monotonic() < deadline_s
        time.sleep(0.05)


@pytest.mark.parametrize("product", PRODUCTS.values(), ids=list(PRODUCTS))
def test_every_product_is_calculated_there_and_its_files_are_served_here(
    server: Server, ground: dict[str, Any], product: Product
) -> None:
    begun_here = [worker.pid for worker in server.workers]
    answer = server.client.post(
        product.path, json={"dem_id": ground["id"], **ASKED[product.name]}, headers={"Prefer": "wait=60"}
    )
    job = server.until_over(answer.headers["Location"])
    assert (job["status"], job["attempts"]) == ("succeeded", 1), job
    for layer in job["layers"]:
        assert server.client.get(layer["href"]).status_code == 200, layer
    # the two processes of the service are for files and probes, and none calculates
    assert len(begun_here) == 2


def test_a_job_is_followed_and_cancelled_and_nothing_of_it_is_left(server: Server, rough: dict[str, Any]) -> None:
    job = server.client.post("/visibility-maps", json=long_job(rough)).headers["Location"]
    server.until(job, lambda told: told["progress"] > 0.02)
    assert calculating()
    server.client.delete(job)
    assert server.client.get(job).json()["status"] == "cancelled"
    until(lambda: not any(computes(one) for one in calculating()))
    until(lambda: not list((server.folder / "work").iterdir()))


def test_a_search_on_the_cluster_ends_with_the_best_so_far_when_it_is_told_to(
    server: Server,
) -> None:
    job = posted(server, request(server.sample(), 15_000))
    server.until(job, lambda told: told["progress"] > 0.02)
    assert server.client.post(f"{job}/stop").status_code == 202
    over = server.until_over(job)
    assert (over["status"], over["result"]["stopped"]) == ("succeeded", True)


def test_a_placement_that_asks_the_cluster_for_help_does_not_wait_for_its_own_place(
    server: Server, ground: dict[str, Any]
) -> None:
    asked = {"dem_id": ground["id"], **ASKED["placement"], "run_on": "cluster"}
    jobs = [server.client.post("/placements", json=asked).headers["Location"] for _ in range(4)]
    assert [server.until_over(job)["status"] for job in jobs] == ["succeeded"] * 4


@pytest.fixture(scope="module")
def tile(server: Server, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A raster in the library of the service that a DEM stays in."""
    folder = tmp_path_factory.mktemp("tiles")
    path = write_cog(folder / "hills.tif", hills_m(), BLOCKSIZE=128, OVERVIEW_RESAMPLING="AVERAGE")
    with edited(server.folder / LIBRARY) as editing:
        editing.library, _ = index_ground(GroundLibrary(), [folder])
    return path


def test_a_map_by_windows_is_the_same_whoever_reads_the_windows(server: Server, tile: Path) -> None:
    made = server.client.post("/dems", json={"tile": tile.name, "resolution_m": 20.0})
    assert made.status_code in (200, 201), made.text
    asked = {"dem_id": made.json()["id"], "anchors": anchors(), "receiver_above_ground_m": 1.5}
    files = []
    for where in ("here", "cluster"):
        posted = server.client.post("/window-maps", json={**asked, "run_on": where})
        job = server.until_over(posted.headers["Location"])
        assert job["status"] == "succeeded", job
        assert ("workers of the Dask scheduler" in job["result"]["read_by"]) == (where == "cluster")
        files.append([server.client.get(layer["href"]).content for layer in job["layers"]])
    assert files[0] == files[1]


def test_a_tile_that_changes_under_a_running_map_ends_it_with_a_sentence(server: Server, tile: Path) -> None:
    made = server.client.post("/dems", json={"tile": tile.name, "resolution_m": 20.0})
    many = [{**anchor, "id": f"{anchor['id']}{n}", "max_range_m": 9000.0} for n in range(16) for anchor in anchors()]
    asked = {"dem_id": made.json()["id"], "anchors": many, "mode": "exact"}
    job = server.client.post("/window-maps", json=asked).headers["Location"]
    server.until(job, lambda told: told["progress"] > 0.02)
    write_cog(tile, hills_m(seed=3))
    over = server.until_over(job)
    assert over["status"] == "failed"
    # as it is being written there is a moment without a file
    assert re.match(r"hills\.tif (was changed since|is not there any more)", over["problem"]["detail"])
    assert not list((server.folder / "work").iterdir())


def test_a_killed_dask_worker_and_a_killed_process_lose_nothing(
    server: Server, cluster: LocalCluster, rough: dict[str, Any]
) -> None:
    jobs = [
        server.client.post("/visibility-maps", json=long_job(rough, anchors)).headers["Location"]
        for anchors in (10, 11)
    ]
    for job in jobs:
        server.until(job, lambda told: told["progress"] > 0.02)
    victim = calculating()[0]
    dask_worker = victim.parent()
    assert dask_worker is not None
    os.kill(dask_worker.pid, signal.SIGKILL)
    until(lambda: has_ended(victim))
    over = [server.until_over(job) for job in jobs]
    assert [job["status"] for job in over] == ["succeeded"] * 2, over
    assert sorted(job["attempts"] for job in over) == [1, 2]
    job = server.client.post("/visibility-maps", json=long_job(rough, 12)).headers["Location"]
    server.until(job, lambda told: told["progress"] > 0.02)
    for one in calculating():
        one.kill()
    over = [server.until_over(job)]
    assert (over[0]["status"], over[0]["attempts"]) == ("succeeded", 2)
    until(lambda: not list((server.folder / "work").iterdir()))


def test_what_the_service_left_unfinished_is_ended_there_and_done_after_its_start(
    cluster: LocalCluster, tmp_path: Path
) -> None:
    where = {"dask_scheduler": cluster.scheduler_address, "calculate_on": "cluster", "workers": 2, "rehearse": "maps"}
    with running(tmp_path / "data", **where) as server:
        rough = upload_rough_ground(server, tmp_path)
        job = server.client.post("/visibility-maps", json=long_job(rough, 10)).headers["Location"]
        server.until(job, lambda told: told["progress"] > 0.02)
        server.kill()
    with running(tmp_path / "data", **where) as server:
        over = server.until_over(job)
        assert (over["status"], over["attempts"]) == ("succeeded", 2)
        assert server.client.get(over["layers"][0]["href"]).status_code == 200
        until(lambda: not list((server.folder / "work").iterdir()))


def test_a_cluster_that_went_away_is_waited_for(tmp_path: Path) -> None:
    with machines() as first:
        port = first.scheduler.port
        where = {"dask_scheduler": first.scheduler_address, "calculate_on": "cluster", "workers": 2, "rehearse": "maps"}
        with running(tmp_path / "data", **where) as server:
            small = server.sample()
            assert (
                server.client.post("/visibility-maps", json=short_job(small), headers={"Prefer": "wait=60"}).status_code
                == 201
            )
            first.close()
            job = server.client.post("/visibility-maps", json=short_job(small, 2)).headers["Location"]
            server.until(job, lambda told: "no Dask scheduler" in server.log.read_text())
            assert server.client.get("/ready").status_code == 200
            address = {"dashboard_address": "127.0.0.1:0", "host": "127.0.0.1", "scheduler_port": port}
            with LocalCluster(n_workers=1, threads_per_worker=1, processes=True, **address):
                over = server.until_over(job)
    assert (over["status"], over["attempts"]) == ("succeeded", 1)
