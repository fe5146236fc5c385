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
from service.cli.own_service import running_service

__all__ = ["streams"]

SESSIONS = 20
ANCHORS = 8
SIGMA_M = 0.1
# so many different epochs per rover, sent over and over with new times
DIFFERENT = 50
TARGET_RATE_HZ = 100.0
NOTE = f"""\
A service in a process of its own, on the loopback interface, once all its workers are warm; {SESSIONS} sessions with
one stream each, {ANCHORS} anchors in three dimensions, one or two of them 2 to 8 m too long, wheel odometry. Every
rover sends by the clock, whether or not the answer before has come, and an answer is timed from when its epoch was
due. The client runs on the same machine and takes its share of it. The target is read as {TARGET_RATE_HZ:g} epochs/s
of all sessions together, five rounds of ranges a second from each of {SESSIONS} rovers; the rows below it show what
more costs, up to {TARGET_RATE_HZ:g} epochs/s of each, which is more than one core answers: there epochs wait."""


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
        for rate_hz in rates_hz:
            # an overload is kept short: what waits in line longer than the pings' patience is cut off
            load = asyncio.run(_load(client, rate_hz, seconds if rate_hz < 50.0 else min(seconds, 3.0)))
            sent = rate_hz * SESSIONS
            answered = f"{load.per_second:,.0f}/s answered"
            what = f"{SESSIONS} streams, {sent:,.0f} epochs/s together, {answered}: answer"
            rows.append(_row(what, load.answers_s, 0.010, judged=sent <= TARGET_RATE_HZ))
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


async def _load(client: httpx.Client, rate_hz: float, seconds: float) -> Load:
    address = str(client.base_url).replace("http", "ws", 1).rstrip("/")
    generator = np.random.default_rng(20)
    sessions = [client.post("/detectors", json=_session()).raise_for_status().json() for _ in range(SESSIONS)]
    epochs = [_epochs(generator, 1.0 / rate_hz) for _ in range(SESSIONS)]
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
    bodies = [{**_session(), "ranges": _ranges(generator, (100.0, 120.0))} for _ in range(DIFFERENT)]
    times_s = []
    for number in range(count):
        begin_s = time.perf_counter()
        client.post("/detections", json=bodies[number % DIFFERENT]).raise_for_status()
        times_s.append(time.perf_counter() - begin_s)
    return times_s


def _places() -> list[tuple[float, float, float]]:
    """Drones on a ring of 400 m at heights between 60 and 200 m."""
    turns = [2.0 * math.pi * number / ANCHORS for number in range(ANCHORS)]
    return [
        (400.0 * math.cos(turn), 400.0 * math.sin(turn), 60.0 + 140.0 * (number * 3 % ANCHORS) / (ANCHORS - 1))
        for number, turn in enumerate(turns)
    ]


def _session() -> dict[str, Any]:
    anchors = [
        {"id": f"D{number + 1}", "east_m": east_m, "north_m": north_m, "altitude_m": altitude_m}
        for number, (east_m, north_m, altitude_m) in enumerate(_places())
    ]
    return {"anchors": anchors, "settings": {"range_sigma_m": SIGMA_M, "max_speed_m_per_s": 3.0}}


def _ranges(generator: np.random.Generator, rover_m: tuple[float, float]) -> list[dict[str, Any]]:
    hidden = set(generator.choice(ANCHORS, size=int(generator.integers(1, 3)), replace=False).tolist())
    return [
        {
            "anchor_id": f"D{number + 1}",
            "range_m": math.dist(place, (*rover_m, 2.0))
            + float(generator.normal(0.0, SIGMA_M))
            + (float(generator.uniform(2.0, 8.0)) if number in hidden else 0.0),
        }
        for number, place in enumerate(_places())
    ]


def _epochs(generator: np.random.Generator, every_s: float) -> list[tuple[str, str]]:
    """Epochs of a rover that goes to and fro at 1 m/s, as JSON before and after the time."""
    pieces = []
    for number in range(DIFFERENT):
        along_m = every_s * min(number, DIFFERENT - number)
        motion = {"duration_s": every_s, "wheel_m": [every_s, 0.0]}
        body = {"time_s": "TIME", "ranges": _ranges(generator, (along_m, 40.0)), "odometry": motion}
        head, tail = json.dumps(body).split('"TIME"')
        pieces.append((head, tail))
    return pieces
