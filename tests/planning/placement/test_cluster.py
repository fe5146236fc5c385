"""A real Dask cluster of two worker processes: the same answer, whatever happens to a worker."""

from __future__ import annotations

import os
import signal
import socket
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest
from distributed import Client, LocalCluster

from planning import ClusterError, PlacementError
from planning.placement import Cluster, Goal, PlacementRules, area_targets, candidate_grid, place_anchors
from tests.planning.placement.grounds import rough_grid

# sockets and loops that distributed closes only as the interpreter ends
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
GRID = rough_grid(96)
CANDIDATES = candidate_grid(GRID, 130.0, above_ground_m=[50.0, 90.0])
TARGETS = area_targets(GRID)
GOAL = Goal("coverage", min_anchors=2)


@pytest.fixture(scope="module")
def cluster() -> Iterator[LocalCluster]:
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0", host="127.0.0.1"
    ) as running:
        yield running


def same(one, other) -> None:
    assert one.candidate.tolist() == other.candidate.tolist()
    assert one.value == other.value
    assert one.bound == other.bound


@pytest.mark.parametrize(
    "rules", [PlacementRules(), PlacementRules(max_range_m=500.0)], ids=["whole ground", "windows"]
)
def test_the_cluster_answers_what_this_machine_answers(cluster: LocalCluster, rules: PlacementRules) -> None:
    shares: list[float] = []
    here = place_anchors(GRID, CANDIDATES, TARGETS, 4, GOAL, rules)
    there = place_anchors(
        GRID, CANDIDATES, TARGETS, 4, GOAL, rules, cluster=cluster.scheduler_address, progress=shares.append
    )
    same(here, there)
    assert not there.warnings
    assert shares == sorted(shares)
    assert len(shares) > 10
    assert shares[-1] == pytest.approx(1.0)


def test_a_killed_worker_loses_nothing(cluster: LocalCluster) -> None:
    here = place_anchors(GRID, CANDIDATES, TARGETS, 4, GOAL)
    killed: list[int] = []

    def kill_one(share: float) -> None:
        if not killed and share > 0.05:
            with Client(cluster.scheduler_address, set_as_default=False) as client:
                pid = next(iter(client.run(os.getpid).values()))
            killed.append(pid)
            os.kill(pid, signal.SIGKILL)

    there = place_anchors(
        GRID, CANDIDATES, TARGETS, 4, GOAL, cluster=Cluster(cluster.scheduler_address), progress=kill_one
    )
    assert killed
    same(here, there)


def test_a_cancelled_run_answers_with_the_best_so_far_and_leaves_no_work_behind(cluster: LocalCluster) -> None:
    enough = threading.Event()

    def watch(share: float) -> None:
        if share > 0.1:
            enough.set()

    placement = place_anchors(
        GRID, CANDIDATES, TARGETS, 4, GOAL, cluster=cluster.scheduler_address, progress=watch, stop=enough.is_set
    )
    assert placement.stopped
    assert len(placement.anchors) == 4
    assert len(placement.feasible.candidates) < len(CANDIDATES)
    assert set(placement.candidate.tolist()) <= set(range(len(CANDIDATES)))
    # a parcel that a worker is at when the run ends is forgotten once it is done
    deadline_s = time.monotonic() + 60.0
    with Client(cluster.scheduler_address, set_as_default=False) as client:
        while left := client.run_on_scheduler(lambda dask_scheduler: list(dask_scheduler.tasks)):
            assert time.monotonic() < deadline_s, left
            time.sleep(0.05)


@pytest.fixture
def nobody() -> str:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return f"tcp://127.0.0.1:{free.getsockname()[1]}"


def test_an_address_where_nobody_answers_is_told_in_a_sentence(nobody: str) -> None:
    with pytest.raises(ClusterError, match="No Dask scheduler answers at"):
        place_anchors(GRID, CANDIDATES, TARGETS, 4, GOAL, cluster=Cluster(nobody, timeout_s=1.0))


def test_a_local_run_in_its_place_is_the_same_with_a_warning(nobody: str) -> None:
    here = place_anchors(GRID, CANDIDATES, TARGETS, 4, GOAL)
    there = place_anchors(GRID, CANDIDATES, TARGETS, 4, GOAL, cluster=Cluster(nobody, or_local=True, timeout_s=1.0))
    same(here, there)
    assert "on this machine instead" in there.warnings[0]


def test_a_scheduler_without_workers_is_told_in_a_sentence() -> None:
    with (
        LocalCluster(n_workers=0, processes=True, dashboard_address="127.0.0.1:0", host="127.0.0.1") as empty,
        pytest.raises(ClusterError, match="has no worker"),
    ):
        place_anchors(GRID, CANDIDATES, TARGETS, 4, GOAL, cluster=Cluster(empty.scheduler_address, timeout_s=1.0))


def test_an_address_that_is_none_is_refused() -> None:
    with pytest.raises(PlacementError, match="address of its scheduler"):
        Cluster("  ")
    with pytest.raises(ClusterError):
        place_anchors(GRID, CANDIDATES, TARGETS, 4, GOAL, cluster=Cluster("nonsense://x", timeout_s=1.0))


def test_the_parcels_of_a_range_limit_see_what_the_whole_ground_sees() -> None:
    from planning.placement import SightOptions
    from planning.placement.cluster import sight_table
    from planning.placement.sight import parcel_bits, parcels

    options = SightOptions("exact", max_range_m=500.0)
    table = sight_table(GRID, TARGETS, CANDIDATES.position_m, options).table
    windows = [make() for make in parcels(GRID, TARGETS, CANDIDATES.position_m, options)]
    assert any(parcel.which is not None for parcel in windows)
    for parcel in windows[:4]:
        from planning.placement.sight import Parcel, SightTable

        whole = parcel_bits(Parcel(parcel.rows, parcel.position_m, GRID, TARGETS, None, options))
        expected = SightTable(whole, len(TARGETS)).visible()
        assert np.mean(table.visible(parcel.rows) != expected) < 1e-5
