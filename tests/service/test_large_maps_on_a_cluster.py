"""Workers of a Dask cluster read their own windows: the same files, whatever happens to a worker."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from distributed import Client, LocalCluster

from planning import ClusterError
from service.products import Work
from service.products.windows.calculate import make_large_map
from service.products.windows.files import COUNT, LOWEST
from terrain import open_dem
from tests.service.large_dems import hills_m, parameters, write_cog

# sockets and loops that distributed closes only as the interpreter ends
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")


@pytest.fixture(scope="module")
def cluster() -> Iterator[LocalCluster]:
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address="127.0.0.1:0", host="127.0.0.1"
    ) as running:
        yield running


def test_a_killed_worker_loses_nothing(cluster: LocalCluster, tmp_path: Path) -> None:
    dem = open_dem(write_cog(tmp_path / "hills.tif", hills_m()))
    (tmp_path / "here").mkdir()
    (tmp_path / "there").mkdir()
    here = make_large_map(dem, parameters(), tmp_path / "here")
    killed: list[int] = []

    def kill_one(share: float) -> None:
        if not killed:
            with Client(cluster.scheduler_address, set_as_default=False) as client:
                pid = next(iter(client.run(os.getpid).values()))
            killed.append(pid)
            os.kill(pid, signal.SIGKILL)

    there = make_large_map(
        dem, parameters(), tmp_path / "there", Work(progress=kill_one, scheduler=cluster.scheduler_address)
    )
    assert killed
    for name in (COUNT, LOWEST):
        assert (tmp_path / "here" / name).read_bytes() == (tmp_path / "there" / name).read_bytes()
    assert there.anchors == here.anchors
    assert "workers of the Dask scheduler" in there.read_by


def test_a_cluster_that_is_not_there_is_one_sentence(tmp_path: Path) -> None:
    dem = open_dem(write_cog(tmp_path / "hills.tif", hills_m()))
    with pytest.raises(ClusterError, match=r"No Dask scheduler answers at 'tcp://127.0.0.1:9'"):
        make_large_map(dem, parameters(), tmp_path, Work(scheduler="tcp://127.0.0.1:9"))
