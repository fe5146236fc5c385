"""What honest clients notice while others are slow, many, or do not read."""

from __future__ import annotations

import asyncio
import json
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import psutil

from benchmarks.report import Row, Table, duration
from benchmarks.service.slow_attackers import ATTACKS
from service.cli.own_service import running_service

__all__ = [
    "HONEST",
    "Honest",
    "Place",
    "asked_in_turn",
    "honest_clients",
    "made_place",
    "resident_bytes",
    "slow_clients",
    "under_attack",
]

HONEST = 20
PAUSE_S = 0.05
CALMS_S, BACK_MB = 10.0, 30.0
TARGET = 3.0
NOTE = f"""\
{HONEST} honest clients, 50 ms between an answer and the next request, ask in turn for /health, a list, a map, a
layer, a probe, a detection and an upload of 20 kB, while others attack from other addresses. The service may open
1,024 descriptors. p99 over all these requests, the attack's divided by that before it; failed is whatever is no
success. Memory is what the server process has resident beyond what it had before the attack, as soon as that is less
than {BACK_MB:g} MB, and {CALMS_S:g} s after it at the latest. The attackers run on the same machine and take their
share of it."""


@dataclass(frozen=True, slots=True)
class Place:
    """What there is to be asked for."""

    url: str
    dem: dict[str, Any]
    map: dict[str, Any]
    detector_id: str


@dataclass(slots=True)
class Honest:
    """How long answers took, and what was no success; grows while clients work."""

    times_s: list[float] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)

    @property
    def p99_s(self) -> float:
        return float(np.percentile(self.times_s, 99.0))


def slow_clients(seconds: float = 10.0, attacks: tuple[str, ...] = tuple(ATTACKS)) -> Table:
    """p99 of honest clients during each attack, what failed, and memory after it."""
    rows = []
    with tempfile.TemporaryDirectory() as folder, _few_descriptors(), running_service(Path(folder)) as client:
        while (workers := client.get("/health").json()["workers"])["warm"] < workers["wanted"]:
            time.sleep(0.2)
        place = made_place(client)
        server = _server_of(place.url)
        asyncio.run(honest_clients(place, seconds / 2))
        for what in attacks:
            before, before_bytes = asyncio.run(honest_clients(place, seconds)), resident_bytes(server)
            with under_attack(place, what):
                during = asyncio.run(honest_clients(place, seconds))
            more_mb = _calmed_mb(server, before_bytes)
            ratio = during.p99_s / before.p99_s
            cells = (
                f"{ATTACKS[what][0]:,} {what}",
                f"{len(during.times_s):,}",
                duration(before.p99_s),
                duration(during.p99_s),
                f"{ratio:.2f}",
                f"{len(during.failures)}",
                f"{more_mb:+.0f} MB",
            )
            met = ratio <= TARGET and not during.failures and more_mb < BACK_MB
            rows.append(Row(cells, f"≤ {TARGET:g}, 0, back", met))
    columns = ("attack", "requests", "p99 before", "p99 during", "ratio", "failed", "memory")
    return Table("Honest clients while others attack", columns, rows, NOTE)


def _calmed_mb(server: int, before_bytes: int) -> float:
    """What it has more than before, once that is little or has had its time."""
    until_s = time.monotonic() + CALMS_S
    while (more_mb := (resident_bytes(server) - before_bytes) / 1e6) >= BACK_MB and time.monotonic() < until_s:
        time.sleep(0.5)
    return more_mb


def made_place(client: httpx.Client) -> Place:
    """A DEM, a map of it and a detector."""
    dem = client.post("/dems", params={"sample": "valley"}).raise_for_status().json()
    bounds = dem["bounds_of_posts_m"]
    east_m, north_m = (bounds["west"] + bounds["east"]) / 2, (bounds["south"] + bounds["north"]) / 2
    anchor = {"id": "A", "east_m": east_m, "north_m": north_m, "above_ground_m": 30.0}
    asked = {"dem_id": dem["id"], "anchors": [anchor]}
    made = client.post("/visibility-maps", json=asked, headers={"Prefer": "wait=60"}).raise_for_status().json()
    detector = client.post("/detectors", json={"anchors": _DETECTOR_ANCHORS}).raise_for_status().json()
    return Place(str(client.base_url).rstrip("/"), dem, made, detector["id"])


_DETECTOR_ANCHORS = [
    {"id": f"A{n}", "east_m": 100.0 * (n % 3), "north_m": 80.0 * (n % 2) + 20.0 * n, "altitude_m": 10.0 * n}
    for n in range(6)
]


async def honest_clients(place: Place, seconds: float, clients: int = HONEST) -> Honest:
    """So many clients at work for so long."""
    honest, until_s = Honest(), time.perf_counter() + seconds

    async def work(number: int) -> None:
        # there is no TLS, and what it would need takes longer to make than many requests
        limits = httpx.AsyncHTTPTransport(retries=1, verify=False)
        async with httpx.AsyncClient(base_url=place.url, transport=limits, timeout=60.0, trust_env=False) as client:
            asks = asked_in_turn(client, place)
            turn = number
            while time.perf_counter() < until_s:
                what, right, ask = asks[turn % len(asks)]
                turn += 1
                begun_s = time.perf_counter()
                try:
                    answer = await ask()
                    if answer.status_code not in right:
                        honest.failures.append(f"{what}: {answer.status_code} {answer.text[:200]}")
                except httpx.HTTPError as error:
                    honest.failures.append(f"{what}: {error!r}")
                honest.times_s.append(time.perf_counter() - begun_s)
                await asyncio.sleep(PAUSE_S)

    await asyncio.gather(*(work(number) for number in range(clients)))
    return honest


Ask = Callable[[], Awaitable[httpx.Response]]


def asked_in_turn(client: httpx.AsyncClient, place: Place, *, maps: bool = False) -> list[tuple[str, set[int], Ask]]:
    """(what, statuses of success, what asks it). maps: also for new maps, which workers calculate."""
    upload = json.dumps({"not a DEM": "x" * 20_000}).encode()
    bounds = place.dem["bounds_of_posts_m"]
    probe = {
        "dem_id": place.dem["id"],
        "points": [{"east_m": bounds["west"] + 50.0, "north_m": bounds["south"] + 50.0}],
    }
    ranges = [{"anchor_id": one["id"], "range_m": 100.0 + n} for n, one in enumerate(_DETECTOR_ANCHORS)]
    detection = {"anchors": _DETECTOR_ANCHORS, "ranges": ranges}
    layer = place.map["layers"][0]["href"]
    asks: list[tuple[str, set[int], Ask]] = [
        ("health", {200}, lambda: client.get("/health")),
        ("list", {200}, lambda: client.get("/visibility-maps", params={"limit": 5})),
        ("map", {200}, lambda: client.get(place.map["links"]["self"])),
        ("layer", {200}, lambda: client.get(layer)),
        ("probe", {200}, lambda: client.post("/probe", json=probe)),
        ("detection", {200}, lambda: client.post("/detections", json=detection)),
        # it is received, read by a worker, and refused as what it is
        ("upload", {422}, lambda: client.post("/dems", params={"filename": "none.tif"}, content=upload)),
    ]
    if maps:
        new = {"dem_id": place.dem["id"], "anchors": place.map["request"]["anchors"]}
        asks.append(("new map", {201, 202}, lambda: client.post("/visibility-maps", json=new)))
    return asks


@contextmanager
def under_attack(place: Place, what: str) -> Iterator[None]:
    """The service while others attack it."""
    address = httpx.URL(place.url)
    arguments = [what, address.host, str(address.port), place.detector_id, place.dem["id"]]
    command = [sys.executable, "-m", "benchmarks.service.slow_attackers", *arguments]
    # 1,100 connections, which this process itself may not have
    attackers = subprocess.Popen(command, stdout=subprocess.PIPE, preexec_fn=_many_descriptors)
    try:
        assert attackers.stdout is not None
        attackers.stdout.readline()
        yield
    finally:
        attackers.kill()
        attackers.wait()
        assert attackers.stdout is not None
        attackers.stdout.close()


def resident_bytes(pid: int) -> int:
    return int(psutil.Process(pid).memory_info().rss)


def _server_of(url: str) -> int:
    """The process that listens there, a child of this one."""
    port = int(re.findall(r":(\d+)", url)[-1])
    for child in psutil.Process().children():
        if any(one.status == psutil.CONN_LISTEN and one.laddr.port == port for one in child.net_connections("tcp")):
            return int(child.pid)
    raise RuntimeError(f"nothing of ours listens at {url}")


@contextmanager
def _few_descriptors() -> Iterator[None]:
    """What is started inside has 1,024, as services on many systems have."""
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (1024, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)


def _many_descriptors() -> None:
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(4096, most), most))
