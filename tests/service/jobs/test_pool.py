"""The worker pool with real processes: limits of time and memory, deaths, and tasks one after the other."""

from __future__ import annotations

import asyncio
import json
import os
import signal
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.errors import TimeLimitError
from service.jobs.folder import DataFolder
from service.jobs.kept_files import save_grid
from service.jobs.pool import Lane, WorkerPool
from service.jobs.process import TaskFailed, WorkerDied
from service.settings import MIB, Settings
from terrain import ElevationGrid

DEM_ID = "0" * 32
SIDE = 1200


@pytest.fixture(autouse=True)
def one_thread_per_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    """Long tasks take long on every machine."""
    monkeypatch.setenv("NUMBA_NUM_THREADS", "1")


@asynccontextmanager
async def pool_of(tmp_path: Path, **limits: Any) -> AsyncIterator[tuple[WorkerPool, DataFolder]]:
    folder = DataFolder.open(tmp_path / "data")
    heights_m = np.random.default_rng(3).normal(0.0, 20.0, (SIDE, SIDE)).astype(np.float32)
    save_grid(ElevationGrid(heights_m, 10.0, 10.0), folder.dem(DEM_ID))
    settings = Settings(data_folder=folder.root, workers=1, file_workers=1, spare_workers=0, **limits)
    pool = WorkerPool(settings, folder)
    pool.start()
    try:
        yield pool, folder
    finally:
        await pool.stop()
        folder.close()


def a_map(anchors: int, mode: str = "fast") -> dict[str, Any]:
    positions = [{"id": f"A{i}", "east_m": 3.0 * i, "north_m": -5.0 * i, "altitude_m": 200.0} for i in range(anchors)]
    return {"dem_id": DEM_ID, "job_id": "j", "parameters": {"anchors": positions, "mode": mode}}


def run(story: Callable[[], Awaitable[None]]) -> None:
    asyncio.run(story())  # type: ignore[arg-type] # coroutine functions return coroutines


def test_a_task_beyond_its_time_is_stopped_and_its_worker_replaced(tmp_path: Path) -> None:
    async def story() -> None:
        async with pool_of(tmp_path, max_job_s=1.5) as (pool, folder):
            with pytest.raises(TimeLimitError, match=r"longer than 1.5 s \(setting SIGHTLINE_MAX_JOB_S\)"):
                await pool.run(Lane.CALCULATIONS, "visibility-map", a_map(200, "exact"))
            assert list((folder.root / "work").iterdir()) == []
            assert (await pool.run(Lane.CALCULATIONS, "visibility-map", a_map(1)))["digest"]

    run(story)


def test_a_task_beyond_its_memory_fails_with_a_sentence_and_its_worker_goes_on(tmp_path: Path) -> None:
    async def story() -> None:
        async with pool_of(tmp_path, max_worker_memory_bytes=128 * MIB) as (pool, _):
            with pytest.raises(TaskFailed) as failed:
                await pool.run(Lane.CALCULATIONS, "visibility-map", a_map(60))
            assert failed.value.failure.error == "service.MemoryLimitError"
            assert "0.125 GiB" in failed.value.failure.detail
            before = pool.pids
            assert (await pool.run(Lane.CALCULATIONS, "visibility-map", a_map(1)))["digest"]
            assert pool.pids == before

    run(story)


def test_a_worker_that_is_killed_is_told_and_replaced(tmp_path: Path) -> None:
    async def story() -> None:
        async with pool_of(tmp_path) as (pool, _):
            progress: list[float] = []
            task = asyncio.create_task(
                pool.run(
                    Lane.CALCULATIONS, "visibility-map", a_map(200, "exact"), token="t", on_progress=progress.append
                )
            )
            while not progress:
                await asyncio.sleep(0.01)
            before = pool.pids
            for pid in before:
                os.kill(pid, signal.SIGKILL)
            with pytest.raises(WorkerDied, match="signal 9"):
                await task
            # the one that stood by has died too, whether that has been noticed or not
            result = await pool.run(Lane.CALCULATIONS, "visibility-map", a_map(1))
            assert result["summary"]["anchors"]
            assert not set(pool.pids) & set(before)

    run(story)


def test_cancelling_a_task_kills_its_process_and_removes_what_it_wrote(tmp_path: Path) -> None:
    async def story() -> None:
        async with pool_of(tmp_path) as (pool, folder):
            progress: list[float] = []
            task = asyncio.create_task(
                pool.run(Lane.CALCULATIONS, "visibility-map", a_map(200, "exact"), on_progress=progress.append)
            )
            while not progress:
                await asyncio.sleep(0.01)
            before = pool.pids
            task.cancel()
            with pytest.raises(asyncio.CancelledError):
                await task
            assert list((folder.root / "work").iterdir()) == []
            await pool.run(Lane.CALCULATIONS, "visibility-map", a_map(1))
            assert pool.pids != before
            assert progress == sorted(progress)
            assert 0.0 <= progress[0] <= progress[-1] <= 1.0

    run(story)


def test_short_tasks_do_not_wait_for_long_calculations(tmp_path: Path) -> None:
    async def story() -> None:
        async with pool_of(tmp_path) as (pool, _):
            long = asyncio.create_task(pool.run(Lane.CALCULATIONS, "visibility-map", a_map(200, "exact")))
            waiting = asyncio.create_task(pool.run(Lane.CALCULATIONS, "visibility-map", a_map(1)))
            body = json.dumps({"dem_id": a_map(1)["dem_id"], **a_map(1)["parameters"]})
            await pool.run(Lane.CHECKS, "check-request", {"product": "visibility-map", "body": {"body": body}})
            assert not long.done()
            assert pool.waiting(Lane.CALCULATIONS) == 1
            for task in (long, waiting):
                task.cancel()
            await asyncio.gather(long, waiting, return_exceptions=True)
            assert pool.waiting(Lane.CALCULATIONS) == 0

    run(story)


def test_a_fault_in_a_task_shows_a_reference_and_not_itself(tmp_path: Path) -> None:
    async def story() -> None:
        async with pool_of(tmp_path) as (pool, _):
            with pytest.raises(TaskFailed) as failed:
                await pool.run(Lane.FILES, "check-request", {"product": "no such product", "body": {"body": "{}"}})
            assert failed.value.failure.error == "service.InternalError"
            assert "no such product" not in failed.value.failure.detail
            assert failed.value.failure.data["reference"] in failed.value.failure.detail

    run(story)
