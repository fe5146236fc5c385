"""The service as a client sees it: a visibility map from question to file, and /health while jobs run."""

from __future__ import annotations

import os
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from unittest import mock

import httpx
import numpy as np

from benchmarks.report import Row, Table, duration
from benchmarks.terrains import CELL_M, fractal_m
from service.cli.own_service import running_service

__all__ = ["question", "requests", "upload_fractal", "wait_until_warm"]

JOBS = 4
NOTE = """\
A service in a process of its own, on the loopback interface, four workers. Each map is asked for with `Prefer: wait=60`
and timed until the first layer, `visible.tif`, is downloaded. The four anchors move a little from one question to the
next, so that no answer is an old one. *Warm* is after the last worker has warmed up."""


def requests(posts: int = 1024, watch_s: float = 8.0) -> Table:
    """Time from POST to file, first and warm, and the latency of /health while four jobs run."""
    begin_s = time.perf_counter()
    with (
        mock.patch.dict(os.environ, {"SIGHTLINE_WORKERS": str(JOBS)}),
        tempfile.TemporaryDirectory() as folder,
        running_service(Path(folder)) as client,
    ):
        ready_s, begin_s = time.perf_counter() - begin_s, time.perf_counter()
        dem_id = upload_fractal(client, Path(folder), posts)
        upload_s = time.perf_counter() - begin_s
        first_s = _map_until_file_s(client, dem_id, posts, 0)
        wait_until_warm(client)
        times_s = [_map_until_file_s(client, dem_id, posts, number) for number in range(1, 13)]
        latencies_s, jobs_done = _health_while_jobs_run(client, dem_id, posts, watch_s)
    warm_s, what = min(times_s), f"POST /visibility-maps, 4 anchors, {posts}², to the file"
    worst_s = float(np.percentile(latencies_s, 99))
    rows = [
        Row(("start of the service until it is ready", duration(ready_s))),
        Row((f"POST /dems, {posts}² .npz", duration(upload_s))),
        Row((f"{what}: first after start, while other workers warm up", duration(first_s))),
        Row((f"{what}: warm, best", duration(warm_s)), "≤ 0.5 s", warm_s <= 0.5),
        Row((f"{what}: warm, median", duration(float(np.median(times_s))))),
        Row(
            (f"GET /health, p99 of {len(latencies_s)} while {JOBS} jobs run ({jobs_done} finished)", duration(worst_s)),
            "≤ 50 ms",
            worst_s <= 0.050,
        ),
        Row(("GET /health, median of the same", duration(float(np.median(latencies_s))))),
    ]
    return Table("Over HTTP", ("what", "time"), rows, NOTE)


def upload_fractal(client: httpx.Client, folder: Path, posts: int) -> str:
    """Fractal ground of posts² posts as a DEM of the service; its id."""
    path = folder / "fractal.npz"
    np.savez(path, heights_m=fractal_m(posts), cell_east_m=CELL_M, cell_north_m=CELL_M)
    with path.open("rb") as stream:
        answer = client.post("/dems", files={"file": stream}, params={"crs": "local"})
    answer.raise_for_status()
    return str(answer.json()["id"])


def wait_until_warm(client: httpx.Client) -> None:
    """Wait for the last worker: a service answers as soon as the first has warmed up."""
    until_s = time.perf_counter() + 120.0
    while (workers := client.get("/health").json()["workers"])["warm"] < workers["wanted"]:
        if time.perf_counter() > until_s:
            raise TimeoutError(f"Only {workers['warm']} of {workers['wanted']} workers warmed up in two minutes.")
        time.sleep(0.2)


def question(dem_id: str, posts: int, number: int, mode: str = "fast") -> dict[str, Any]:
    """Four anchors around the middle, a centimetre further east for every number."""
    extent_m = (posts - 1) * CELL_M
    anchors = [
        {
            "id": f"D{index + 1}",
            "east_m": extent_m * (0.3 + 0.4 * (index % 2)) + 0.01 * number,
            "north_m": -extent_m * (0.3 + 0.4 * (index // 2)),
            "above_ground_m": 80.0,
        }
        for index in range(4)
    ]
    return {"dem_id": dem_id, "anchors": anchors, "receiver_above_ground_m": 1.5, "mode": mode}


def _map_until_file_s(client: httpx.Client, dem_id: str, posts: int, number: int) -> float:
    begin_s = time.perf_counter()
    answer = client.post("/visibility-maps", json=question(dem_id, posts, number), headers={"Prefer": "wait=60"})
    answer.raise_for_status()
    layers = {layer["name"]: layer["href"] for layer in answer.json()["layers"]}
    client.get(layers["visible.tif"]).raise_for_status()
    return time.perf_counter() - begin_s


def _health_while_jobs_run(client: httpx.Client, dem_id: str, posts: int, watch_s: float) -> tuple[list[float], int]:
    """Latencies of /health, seconds, while JOBS clients keep one exact map each under way; and maps finished."""
    over = threading.Event()

    def keep_busy(client_number: int) -> int:
        done = 0
        with httpx.Client(base_url=client.base_url, timeout=120.0, trust_env=False) as busy:
            while not over.is_set():
                asked = question(dem_id, posts, 1000 * (client_number + 1) + done, "exact")
                busy.post("/visibility-maps", json=asked, headers={"Prefer": "wait=60"}).raise_for_status()
                done += 1
        return done

    latencies_s = []
    with ThreadPoolExecutor(JOBS) as threads:
        try:
            finished = [threads.submit(keep_busy, number) for number in range(JOBS)]
            until_s = time.perf_counter() + watch_s
            while time.perf_counter() < until_s:
                begin_s = time.perf_counter()
                client.get("/health").raise_for_status()
                latencies_s.append(time.perf_counter() - begin_s)
                time.sleep(0.005)
        finally:
            over.set()
    return latencies_s, sum(future.result() for future in finished)
