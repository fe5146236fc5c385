"""A store of many finished jobs: how long a start takes beside that of an empty folder, and how long a page.

    python -m benchmarks.service.many_jobs [jobs]

A start is over when a page of jobs is answered; when a worker is warm is told beside it. Each job has a result of its
own on the disk. The last start is one whose results were all lost. Pages are read one after another to the end.
"""

from __future__ import annotations

import json
import shutil
import statistics
import sys
import tempfile
import time
from pathlib import Path

from service.jobs.folder import DataFolder
from service.jobs.records import DemRecord, JobStatus
from service.jobs.store import Store
from tests.service.running import Server, running

JOBS = 100_000
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


def main() -> None:
    """Print the table."""
    jobs = int(sys.argv[1]) if len(sys.argv) > 1 else JOBS
    with tempfile.TemporaryDirectory() as place:
        root = Path(place) / "full"
        fill(root, jobs)
        told("start of an empty folder", Path(place) / "empty")
        told(f"first start with {jobs:,} jobs", root)
        told("start after that", root)
        shutil.rmtree(root / "results")
        (root / "results").mkdir()
        told("start after all results were lost", root)


def told(words: str, root: Path) -> None:
    """Start once, and print what it took."""
    answers_s, ready_s, page_s = started(root)
    median_ms, worst_ms = statistics.median(page_s) * 1e3, max(page_s) * 1e3
    of_pages = f"{len(page_s)} pages: median {median_ms:.1f} ms, worst {worst_ms:.1f} ms"
    print(f"{words:40} {answers_s:8.2f} s, a worker is warm after {ready_s:.2f} s; {of_pages}", flush=True)


if __name__ == "__main__":
    main()
