"""How SQLite goes about what the store asks of many jobs, nearly all of them over: by the index that leads to few."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from service.database import READ, WRITE
from service.jobs.records import DemRecord, JobRecord, JobStatus
from service.jobs.store import Store

ASKED: dict[str, tuple[Callable[[Store], object], str]] = {
    "jobs that wait or run": (lambda store: store.active_jobs(), "jobs_active"),
    "results from one on": (lambda store: store.succeeded("", 10), "sqlite_autoindex_jobs_1"),
    "who needs a DEM": (lambda store: store.remove_dem("d1"), "jobs_active"),
}


@pytest.mark.parametrize("what", ASKED)
def test_few_jobs_are_looked_at_and_nothing_is_sorted(what: str, tmp_path: Path) -> None:
    ask, index = ASKED[what]
    path = tmp_path / "sightline.sqlite3"
    store = Store(path)
    store.add_dem(DemRecord("d1", "hill.tif", 1.0, {"rows": 3}))
    for number in range(50):
        store.add_job(JobRecord(f"j{number}", "visibility-map", "d1", {}, JobStatus.QUEUED, float(number)))
        store.finish_job(f"j{number}", JobStatus.SUCCEEDED, digest=f"r{number}")
    statements: list[str] = []
    for begin in (READ, WRITE):
        with store.transaction(begin) as connection:
            assert isinstance(connection, sqlite3.Connection)
            connection.set_trace_callback(statements.append)
    ask(store)
    store.close()
    with closing(sqlite3.connect(path)) as connection:
        plans = [
            str(row[3])
            for statement in statements
            if statement.startswith("SELECT") and "FROM jobs" in statement
            for row in connection.execute(f"EXPLAIN QUERY PLAN {statement}")
        ]
    assert plans
    assert all(f"USING INDEX {index}" in plan or f"USING COVERING INDEX {index}" in plan for plan in plans), plans
