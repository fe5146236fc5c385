"""Detector sessions over WebSocket: how long an answer takes when twenty rovers send at once."""

from __future__ import annotations

import asyncio
import json
import math
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from websockets.asyncio.client import ClientConnection, connect

from benchmarks.report import Row, Table, duration
from dem_samples import load_sample
from service.cli.own_service import running_service
from terrain import ElevationGrid, height_at

__all__ = ["streams"]

SESSIONS = 20
ANCHORS = 8
SIGMA_M = 0.1
# so many different epochs per rover, sent over and over with new times
DIFFERENT = 50
TARGET_RATE_HZ = 100.0
REACH_M = 400.0
PLAIN_S, MAPPED_S = 0.010, 0.015  # targets of p99
NOTE = f"""\
A service in a process of its own, on the loopback interface, once all its workers are warm; {SESSIONS} sessions with
one stream each, {ANCHORS} anchors in three dimensions, one or two of them 2 to 8 m too long, wheel odometry. Every
rover sends by the clock, whether or not the answer before has come, and an answer is timed from when its epoch was
due. The client runs on the same machine and takes its share of it. The target is read as {TARGET_RATE_HZ:g} epochs/s
of all sessions together, five rounds of ranges a second from each of {SESSIONS} rovers; the rows below it show what
more costs, up to {TARGET_RATE_HZ:g} epochs/s of each, which is more than one core answers: there epochs wait. *Over a
map*: every session looks at the DEM of Jacksboro (90 m cells), its drones {REACH_M:g} m around it."""


@dataclass(frozen=True, slots=True)
class Site:
    """Where rovers drive: a DEM that sessions look at, its id, and the place amid the drones; a plain without them."""

    grid: ElevationGrid | None = None
    dem_id: str | None = None
    middle_m: tuple[float, float] = (0.0, 0.0)

    def ground_m(self, east_m: float, north_m: float) -> float:
        """Altitude of the ground at a place amid the drones."""
        at_m = (self.middle_m[0] + east_m, self.middle_m[1] + north_m)
        return 0.0 if self.grid is None else float(height_at(self.grid, *at_m))


@dataclass(frozen=True, slots=True)
class Load:
    """What came of one run: the time of each answer and of each /health, and how many epochs were sent."""

    answers_s: list[float]
    health_s: list[float]
    per_second: float


def streams(seconds: float = 8.0, rates_hz: tuple[float, ...] = (5.0, 25.0, 100.0)) -> Table:
    """p99 of answers, and of /health beside them. rates_hz: epochs per second of each of the 20 sessions."""
    rows = []
    with tempfile.TemporaryDirectory() as folder, running_service(Path(folder)) as client:
        _wait_until_calm(client)
        plain, mapped = Site(), _mapped(client)
        for rate_hz in rates_hz:
            # an overload is kept short: what waits in line longer than the pings' patience is cut off
            load = asyncio.run(_load(client, plain, rate_hz, seconds if rate_hz < 50.0 else min(seconds, 3.0)))
            sent = rate_hz * SESSIONS
            answered = f"{load.per_second:,.0f}/s answered"
            what = f"{SESSIONS} streams, {sent:,.0f} epochs/s together, {answered}: answer"
            rows.append(_row(what, load.answers_s, PLAIN_S, judged=sent <= TARGET_RATE_HZ))
            rows.append(_row("GET /health meanwhile", load.health_s, 0.050, judged=True))
        load = asyncio.run(_load(client, mapped, TARGET_RATE_HZ / SESSIONS, seconds))
        what = f"{SESSIONS} streams over a map, {TARGET_RATE_HZ:g} epochs/s together, {load.per_second:,.0f}/s answered"
        rows.append(_row(f"{what}: answer", load.answers_s, MAPPED_S, judged=True))
        rows.append(_row("GET /health meanwhile", load.health_s, 0.050, judged=True))
        rows.append(_row("POST /detections, one after the other", _stateless_s(client, 500), 0.010, judged=False))
    return Table("Detectors over WebSocket and HTTP", ("what", "number", "median", "p99"), rows, NOTE)


def _row(what: str, times_s: list[float], target_s: float, *, judged: bool) -> Row:
    median_s, p99_s = np.percentile(times_s, [50.0, 99.0]).tolist()
    cells = (what, str(len(times_s)), duration(median_s), duration(p99_s))
    return Row(cells, f"p99 ≤ {duration(target_s)}", p99_s <= target_s) if judged else Row(cells)


def _wait_until_calm(client: httpx.Client) -> None:
    """Until no worker warms up any more: that takes every core."""
    while (workers := client.get("/health").raise_for_status().json()["workers"])["warm"] < workers["wanted"]:
        time.sleep(0.2)
    time.sleep(1.0)


def _mapped(client: httpx.Client) -> Site:
    """The sample in the service, and its middle."""
    dem_id = client.post("/dems", params={"sample": "jacksboro"}).raise_for_status().json()["id"]
    grid = load_sample("jacksboro")
    west_m, south_m, east_m, north_m = grid.bounds_m
    return Site(grid, dem_id, (0.5 * (west_m + east_m), 0.5 * (south_m + north_m)))


async def _load(client: httpx.Client, site: Site, rate_hz: float, seconds: float) -> Load:
    address = str(client.base_url).replace("http", "ws", 1).rstrip("/")
    generator = np.random.default_rng(20)
    sessions = [client.post("/detectors", json=_session(site)).raise_for_status().json() for _ in range(SESSIONS)]
    epochs = [_epochs(generator, site, 1.0 / rate_hz) for _ in range(SESSIONS)]
    connections = [
        await connect(address + s["links"]["stream"], proxy=None, compression=None, ping_interval=None)
        for s in sessions
    ]
    try:
        begin_s = time.perf_counter() + 0.2
        count = int(seconds * rate_hz)
        health = asyncio.create_task(_watch_health(str(client.base_url)))
        rovers = [
            _rover(connection, mine, begin_s + number / (rate_hz * SESSIONS), rate_hz, count)
            for number, (connection, mine) in enumerate(zip(connections, epochs, strict=True))
        ]
        answers_s = [time_s for times_s in await asyncio.gather(*rovers) for time_s in times_s]
        elapsed_s = time.perf_counter() - begin_s
        health.cancel()
        [health_s] = await asyncio.gather(health)
    finally:
        for connection in connections:
            await connection.close()
        for session in sessions:
            client.delete(session["links"]["self"]).raise_for_status()
    return Load(answers_s, health_s, len(answers_s) / elapsed_s)


async def _rover(
    connection: ClientConnection, epochs: list[tuple[str, str]], begin_s: float, rate_hz: float, count: int
) -> list[float]:
    """Send by the clock; the time of each answer since its epoch was due, the first second left out."""

    async def send() -> None:
        for number in range(count):
            await asyncio.sleep(begin_s + number / rate_hz - time.perf_counter())
            head, tail = epochs[number % len(epochs)]
            await connection.send(f"{head}{number / rate_hz}{tail}")

    sending = asyncio.create_task(send())
    times_s = []
    for number in range(count):
        answer = await connection.recv()
        times_s.append(time.perf_counter() - (begin_s + number / rate_hz))
        if '"rejection":null' not in str(answer):
            raise RuntimeError(f"An epoch was not used: {str(answer)[:200]}")
    await sending
    return times_s[int(rate_hz) :]


async def _watch_health(url: str) -> list[float]:
    times_s: list[float] = []
    async with httpx.AsyncClient(base_url=url, trust_env=False) as client:
        try:
            while True:
                begin_s = time.perf_counter()
                (await client.get("/health")).raise_for_status()
                times_s.append(time.perf_counter() - begin_s)
                await asyncio.sleep(0.02)
        except asyncio.CancelledError:
            return times_s


def _stateless_s(client: httpx.Client, count: int) -> list[float]:
    generator = np.random.default_rng(21)
    bodies = [{**_session(Site()), "ranges": _ranges(generator, Site(), (100.0, 120.0))} for _ in range(DIFFERENT)]
    times_s = []
    for number in range(count):
        begin_s = time.perf_counter()
        client.post("/detections", json=bodies[number % DIFFERENT]).raise_for_status()
        times_s.append(time.perf_counter() - begin_s)
    return times_s


def _places(site: Site) -> list[tuple[float, float, float]]:
    """Drones on a ring at heights between 60 and 200 m above the ground; east and north from the middle."""
    turns = [2.0 * math.pi * number / ANCHORS for number in range(ANCHORS)]
    ring_m = [(REACH_M * math.cos(turn), REACH_M * math.sin(turn)) for turn in turns]
    return [
        (*at_m, site.ground_m(*at_m) + 60.0 + 140.0 * (number * 3 % ANCHORS) / (ANCHORS - 1))
        for number, at_m in enumerate(ring_m)
    ]


def _session(site: Site) -> dict[str, Any]:
    anchors = [
        {
            "id": f"D{number + 1}",
            "east_m": site.middle_m[0] + east_m,
            "north_m": site.middle_m[1] + north_m,
            "altitude_m": altitude_m,
        }
        for number, (east_m, north_m, altitude_m) in enumerate(_places(site))
    ]
    settings = {"range_sigma_m": SIGMA_M, "max_speed_m_per_s": 3.0}
    over_a_map = {} if site.dem_id is None else {"dem_id": site.dem_id}
    return {"anchors": anchors, "settings": settings, **over_a_map}


def _ranges(generator: np.random.Generator, site: Site, rover_m: tuple[float, float]) -> list[dict[str, Any]]:
    hidden = set(generator.choice(ANCHORS, size=int(generator.integers(1, 3)), replace=False).tolist())
    return [
        {
            "anchor_id": f"D{number + 1}",
            "range_m": math.dist(place, (*rover_m, site.ground_m(*rover_m) + 1.5))
            + float(generator.normal(0.0, SIGMA_M))
            + (float(generator.uniform(2.0, 8.0)) if number in hidden else 0.0),
        }
        for number, place in enumerate(_places(site))
    ]


def _epochs(generator: np.random.Generator, site: Site, every_s: float) -> list[tuple[str, str]]:
    """Epochs of a rover that goes to and fro at 1 m/s, as JSON before and after the time."""
    pieces = []
    for number in range(DIFFERENT):
        along_m = every_s * min(number, DIFFERENT - number)
        motion = {"duration_s": every_s, "wheel_m": [every_s, 0.0]}
        body = {"time_s": "TIME", "ranges": _ranges(generator, site, (along_m, 40.0)), "odometry": motion}
        head, tail = json.dumps(body).split('"TIME"')
        pieces.append((head, tail))
    return pieces
