"""A store of many finished jobs: how long a start takes beside that of an empty folder, and how long a page."""

from __future__ import annotations

import json
import os
import shutil
import statistics
import tempfile
import time
from pathlib import Path

from benchmarks.report import Row, Table, duration
from service.jobs.folder import DataFolder
from service.jobs.records import DemRecord, JobStatus
from service.jobs.store import Store
from tests.service.running import Server, running

__all__ = ["many_jobs"]

JOBS = 100_000
START_S, LOST_START_S, PAGE_S = 3.0, 10.0, 0.050
NOTE = """\
From the beginning of `sightline serve` until it has answered a page of jobs; when the first worker is warm is told
beside it. Each job has a result of its own on the disk. Pages of 50 are read from the newest job to the oldest, with
ten of 200 between two that are measured, while the service notes and measures results as it does after any start."""
DEM = "d" * 32
KIND = "visibility-map"
SUMMARY = {"version": "0.1.0", "share_visible": 0.5, "warnings": []}
REQUEST = {"parameters": {"anchors": [{"id": "A", "east_m": 1.0, "north_m": 2.0, "above_ground_m": 3.0}]}}


def fill(root: Path, jobs: int) -> None:
    """Make a data folder of so many jobs, straight into its store."""
    folder = DataFolder.open(root)
    store = Store(folder.database)
    store.add_dem(DemRecord(DEM, "hill.tif", 1.0, {"sha256": "0" * 64}))
    folder.dem(DEM).mkdir()
    request, summary = json.dumps(REQUEST), json.dumps(SUMMARY)
    ids = [f"{number:032x}" for number in range(jobs)]
    with store.transaction() as connection:
        connection.executemany(
            "INSERT INTO jobs (id, kind, dem_id, request, status, created_at_s, started_at_s, finished_at_s, attempts, "
            "digest, summary) VALUES (?, ?, ?, ?, ?, ?, ?, ?, 1, ?, ?)",
            [
                (name, KIND, DEM, request, JobStatus.SUCCEEDED, 1e9 + n, 1e9 + n, 1e9 + n, name, summary)
                for n, name in enumerate(ids)
            ],
        )
    for name in ids:
        folder.result(name).mkdir()
        (folder.result(name) / "answer.json").write_text(summary)
    store.close()
    folder.close()


def started(root: Path) -> tuple[float, float, list[float]]:
    """Seconds until it answers a page, until a worker is warm, and of each page."""
    begun_s = time.perf_counter()
    with running(root, await_worker=False, workers=1, rehearse="maps") as server:
        server.client.get("/visibility-maps").raise_for_status()
        answers_s = time.perf_counter() - begun_s
        while not server.client.get("/ready").is_success:
            time.sleep(0.02)
        ready_s = time.perf_counter() - begun_s
        return answers_s, ready_s, pages(server)


def pages(server: Server) -> list[float]:
    """Pages from the first to the last, with long ones between that are not measured."""
    seconds, query = [], {"limit": "50"}
    while True:
        begun_s = time.perf_counter()
        page = server.client.get("/visibility-maps", params=query).raise_for_status().json()
        seconds.append(time.perf_counter() - begun_s)
        for _ in range(10):
            if page["next"] is None:
                return seconds
            far = {"limit": "200", "cursor": page["next"]}
            page = server.client.get("/visibility-maps", params=far).raise_for_status().json()
        if page["next"] is None:
            return seconds
        query["cursor"] = page["next"]


def many_jobs(jobs: int = JOBS) -> Table:
    """One row per start."""
    with tempfile.TemporaryDirectory() as place:
        root = Path(place) / "full"
        # what is installed has its bytecode; without it each start would compile 600 modules, and the first one does
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
        started(Path(place) / "before")
        rows = [_row("of an empty folder", Path(place) / "empty", None)]
        fill(root, jobs)
        rows += [_row(f"{words} with {jobs:,} jobs", root, START_S) for words in ("the first", "the next")]
        shutil.rmtree(root / "results")
        (root / "results").mkdir()
        rows.append(_row(f"once all results of {jobs:,} jobs were lost", root, LOST_START_S))
    columns = ("start", "answers after", "a worker is warm after", "pages", "median", "slowest")
    return Table("A store of many jobs", columns, rows, NOTE)


def _row(words: str, root: Path, most_s: float | None) -> Row:
    answers_s, ready_s, page_s = started(root)
    slowest_s = max(page_s)
    cells = (
        words,
        duration(answers_s),
        duration(ready_s),
        f"{len(page_s):,}",
        duration(statistics.median(page_s)),
        duration(slowest_s),
    )
    if most_s is None:
        return Row(cells)
    target = f"answers ≤ {duration(most_s)}, any page ≤ {duration(PAGE_S)}"
    return Row(cells, target, answers_s <= most_s and slowest_s <= PAGE_S)
