"""A job ends also when no worker process can be had: none starts, or every one hangs while it starts."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

import pytest

from service.jobs import pool as pool_module
from service.jobs.folder import DataFolder
from service.jobs.pool import WorkerPool
from service.jobs.records import DemRecord, JobStatus
from service.jobs.store import Store
from service.jobs.supervisor import Supervisor
from service.settings import Settings


@pytest.mark.parametrize("program", ["#!/bin/sh\nexit 3\n", "#!/bin/sh\nexec sleep 60\n"], ids=["none starts", "hangs"])
def test_a_job_that_no_worker_can_take_is_interrupted_with_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, program: str
) -> None:
    python = tmp_path / "python"
    python.write_text(program)
    python.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(python))
    monkeypatch.setattr(pool_module, "START_MAY_TAKE_S", 0.6)

    async def story() -> None:
        folder = DataFolder.open(tmp_path / "data")
        settings = Settings(data_folder=folder.root, workers=1, file_workers=1, spare_workers=0)
        store, pool = Store(folder.database), WorkerPool(settings, folder)
        supervisor = Supervisor(settings, folder, store, pool)
        store.add_dem(DemRecord("d1", "hill.tif", 1.0, {}))
        pool.start()
        try:
            job = await supervisor.submit("visibility-map", "d1", {})
            await supervisor.wait(job.id, 20.0)
            over = store.job("visibility-map", job.id)
            assert (over.status, over.attempts) == (JobStatus.INTERRUPTED, 0)
            assert over.failure is not None
            assert over.failure.detail.startswith("No worker process could be started within 0.6 s")
            assert pool.warm == 0
        finally:
            await supervisor.stop()
            await pool.stop()
            store.close()
            folder.close()

    asyncio.run(story())
