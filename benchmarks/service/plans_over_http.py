"""Plans beside everybody else: /health while four paths are planned at once, and how soon a cancelled one is gone."""

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
import psutil

from benchmarks.report import Row, Table, duration
from benchmarks.service.over_http import upload_fractal, wait_until_warm
from benchmarks.terrains import CELL_M
from service.cli.own_service import running_service

__all__ = ["plans_over_http"]

PLANS = 4
SLOPE_DEG = 60.0
NOTE = """\
A service in a process of its own, on the loopback interface, four workers. Each of four clients keeps one plan under
way: corner to corner over fractal ground, four anchors, sampling planner on. A cancelled plan counts as gone when
DELETE has answered and no process of its planner runs any more."""


def plans_over_http(posts: int = 512, watch_s: float = 10.0, cancelled: int = 4) -> Table:
    """Latency of /health while four plans run, and the time from DELETE until a plan's processes are gone."""
    with (
        mock.patch.dict(os.environ, {"SIGHTLINE_WORKERS": str(PLANS)}),
        tempfile.TemporaryDirectory() as folder,
        running_service(Path(folder)) as client,
    ):
        dem_id = upload_fractal(client, Path(folder), posts)
        wait_until_warm(client)
        _planned(client, _question(dem_id, posts, 0, 500))
        latencies_s, finished = _health_while_planning(client, dem_id, posts, watch_s)
        gone_s = [_gone_s(client, dem_id, posts) for _ in range(cancelled)]
    worst_s, slowest_s = float(np.percentile(latencies_s, 99)), max(gone_s)
    rows = [
        Row(
            (
                f"GET /health, p99 of {len(latencies_s)} while {PLANS} plans run ({finished} finished)",
                duration(worst_s),
            ),
            "≤ 50 ms",
            worst_s <= 0.050,
        ),
        Row(("GET /health, median of the same", duration(float(np.median(latencies_s))))),
        Row(
            (f"DELETE of a plan until its processes are gone, worst of {cancelled}", duration(slowest_s)),
            "≤ 1 s",
            slowest_s <= 1.0,
        ),
    ]
    return Table("Plans over HTTP", ("what", "time"), rows, NOTE)


def _question(dem_id: str, posts: int, seed: int, iterations: int) -> dict[str, Any]:
    """From near one corner to near the other; the ground is rough, so the rover climbs what others would not."""
    extent_m = (posts - 1) * CELL_M
    places = [(0.3, 0.3), (0.7, 0.3), (0.3, 0.7), (0.7, 0.7)]
    return {
        "dem_id": dem_id,
        "start": {"east_m": 0.05 * extent_m, "north_m": -0.05 * extent_m},
        "goals": [{"east_m": 0.95 * extent_m, "north_m": -0.95 * extent_m}],
        "anchors": [
            {"id": f"D{n}", "east_m": east * extent_m, "north_m": -south * extent_m, "above_ground_m": 200.0}
            for n, (east, south) in enumerate(places)
        ],
        "rover": {"max_slope_deg": SLOPE_DEG},
        "mode": "fast",
        "seed": seed,
        "budget": {"iterations": iterations, "seconds": 300.0},
    }


def _planned(client: httpx.Client, question: dict[str, Any]) -> None:
    answer = client.post("/paths", json=question, headers={"Prefer": "wait=60"})
    answer.raise_for_status()


def _health_while_planning(client: httpx.Client, dem_id: str, posts: int, watch_s: float) -> tuple[list[float], int]:
    """Latencies of /health, seconds, while PLANS clients keep one plan each under way; and plans finished."""
    over = threading.Event()

    def keep_busy(number: int) -> int:
        done = 0
        with httpx.Client(base_url=client.base_url, timeout=300.0, trust_env=False) as busy:
            while not over.is_set():
                _planned(busy, _question(dem_id, posts, 1000 * number + done, 20_000))
                done += 1
        return done

    latencies_s = []
    with ThreadPoolExecutor(PLANS) as threads:
        try:
            finished = [threads.submit(keep_busy, number) for number in range(1, PLANS + 1)]
            until_s = time.perf_counter() + watch_s
            while time.perf_counter() < until_s:
                begin_s = time.perf_counter()
                client.get("/health").raise_for_status()
                latencies_s.append(time.perf_counter() - begin_s)
                time.sleep(0.005)
        finally:
            over.set()
    return latencies_s, sum(future.result() for future in finished)


def _gone_s(client: httpx.Client, dem_id: str, posts: int) -> float:
    """From DELETE until no process of the planner runs."""
    posted = client.post("/paths", json=_question(dem_id, posts, 7, 10_000_000))
    posted.raise_for_status()
    deadline_s = time.perf_counter() + 60.0
    while not (at_work := _solvers()):
        if time.perf_counter() > deadline_s:
            raise TimeoutError("The planner's own process never came to work.")
        time.sleep(0.05)
    begin_s = time.perf_counter()
    client.delete(posted.headers["Location"]).raise_for_status()
    while any(one.is_running() and one.status() != psutil.STATUS_ZOMBIE for one in at_work):
        time.sleep(0.005)
    return time.perf_counter() - begin_s


def _solvers() -> list[psutil.Process]:
    """Processes of the planner that have worked for a while; workers that start rehearse with shorter ones."""
    found = []
    for one in psutil.Process().children(recursive=True):
        try:
            if "planning.paths.solving" in " ".join(one.cmdline()) and one.cpu_times().user > 2.0:
                found.append(one)
        except psutil.NoSuchProcess:
            continue
    return found
