"""A job whose planner dies is tried again as one whose worker does; other failures are told at once."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from planning import PlanningProcessError
from service.jobs.folder import DataFolder
from service.jobs.pool import Lane, WorkerPool
from service.jobs.process import TaskFailed, WorkerDied
from service.jobs.records import DemRecord, Failure, JobRecord, JobStatus
from service.jobs.store import Store
from service.jobs.supervisor import Supervisor
from service.settings import Settings

Outcome = Exception | Mapping[str, object]
PLANNER_DIED = TaskFailed(Failure.of(PlanningProcessError("The process that planned ended before its answer.")))
REFUSED = TaskFailed(Failure("planning.PathProblemError", "No way."))
DONE = {"digest": "d" * 32, "summary": {"share": 1.0}}


class Outcomes(WorkerPool):
    """A pool without processes: each attempt ends as it is told."""

    def __init__(self, settings: Settings, folder: DataFolder, outcomes: list[Outcome]) -> None:
        super().__init__(settings, folder)
        self._outcomes = outcomes

    async def run(
        self,
        lane: Lane,
        task: str,
        arguments: Mapping[str, object],
        *,
        on_start: Callable[[], Awaitable[None]] | None = None,
        **_: Any,
    ) -> Mapping[str, object]:
        assert on_start is not None
        await on_start()
        outcome = self._outcomes.pop(0)
        if isinstance(outcome, Exception):
            raise outcome
        return outcome


@pytest.mark.parametrize(
    ("outcomes", "status", "attempts"),
    [
        ([PLANNER_DIED, DONE], JobStatus.SUCCEEDED, 2),
        ([PLANNER_DIED, PLANNER_DIED], JobStatus.INTERRUPTED, 2),
        ([WorkerDied(-9), PLANNER_DIED], JobStatus.INTERRUPTED, 2),
        ([WorkerDied("the loss of its Dask worker"), DONE], JobStatus.SUCCEEDED, 2),
        ([REFUSED], JobStatus.FAILED, 1),
    ],
    ids=["once", "twice", "after its worker", "after its machine", "another failure"],
)
def test_so_often_it_is_tried(tmp_path: Path, outcomes: list[Outcome], status: JobStatus, attempts: int) -> None:
    async def story() -> JobRecord:
        settings, folder = Settings(data_folder=tmp_path / "data"), DataFolder.open(tmp_path / "data")
        store = Store(folder.database)
        store.add_dem(DemRecord("dem", "hill.tif", 1.0, {}))
        supervisor = Supervisor(settings, folder, store, Outcomes(settings, folder, [*outcomes]))
        job = await supervisor.submit("path", "dem", {"parameters": {}})
        await supervisor.wait(job.id, 10.0)
        over = store.job("path", job.id)
        await supervisor.stop()
        store.close()
        folder.close()
        return over

    over = asyncio.run(story())
    assert (over.status, over.attempts) == (status, attempts)
