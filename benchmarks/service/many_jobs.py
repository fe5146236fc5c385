"""A store of many finished jobs: how long a start takes beside that of an empty folder, and how long a page.

    python -m benchmarks.service.many_jobs [jobs]

Each job has a result of its own on the disk. The last start is one whose results were all lost.
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
PAGES = 40
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


def started(root: Path, look: bool) -> tuple[float, list[float]]:
    """Seconds to ready, and of each page."""
    begun_s = time.perf_counter()
    with running(root, workers=1, rehearse="maps") as server:
        ready_s = time.perf_counter() - begun_s
        return ready_s, pages(server) if look else []


def pages(server: Server) -> list[float]:
    total = server.client.get("/visibility-maps", params={"limit": 1}).json()["total"]
    seconds = []
    for turn in range(PAGES):
        offset = (total - 50) * turn // (PAGES - 1)
        begun_s = time.perf_counter()
        server.client.get("/visibility-maps", params={"limit": 50, "offset": offset}).raise_for_status()
        seconds.append(time.perf_counter() - begun_s)
    return seconds


def main() -> None:
    """Print the table."""
    jobs = int(sys.argv[1]) if len(sys.argv) > 1 else JOBS
    with tempfile.TemporaryDirectory() as place:
        empty_s, _ = started(Path(place) / "empty", look=False)
        root = Path(place) / "full"
        fill(root, jobs)
        first_s, _ = started(root, look=False)
        again_s, page_s = started(root, look=True)
        shutil.rmtree(root / "results")
        lost_s, _ = started(root, look=False)
    print(f"{'start of an empty folder':45} {empty_s:8.2f} s")
    for words, seconds in (
        (f"first start with {jobs:,} jobs (notes written)", first_s),
        ("start after that", again_s),
        ("start after all results were lost", lost_s),
    ):
        print(f"{words:45} {seconds:8.2f} s, {seconds - empty_s:+.2f} s")
    print(f"{'page of 50, median':45} {statistics.median(page_s) * 1e3:8.1f} ms")
    print(f"{'page of 50, slowest of ' + str(PAGES):45} {max(page_s) * 1e3:8.1f} ms")


if __name__ == "__main__":
    main()
