"""Requests that ask for much with little, sent again and again, and how long /health takes meanwhile."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np

from benchmarks.report import Row, Table, duration
from service.cli.own_service import running_service

__all__ = ["attack_bodies", "attacked", "health_times_s", "health_under_attack"]

ATTACKERS = 4
TARGET_S = 0.100
NOTE = f"""\
A service in a process of its own, on the loopback interface. {ATTACKERS} clients, each a process, send the same body
again and again as soon as it is answered; /health is asked for every 20 ms meanwhile. The clients run on the same
machine and take their share of it."""
JSON = {"Content-Type": "application/json"}


def health_under_attack(seconds: float = 10.0) -> Table:
    """p99 of /health while each attack lasts."""
    rows = []
    with tempfile.TemporaryDirectory() as folder, running_service(Path(folder)) as client:
        while (workers := client.get("/health").json()["workers"])["warm"] < workers["wanted"]:
            time.sleep(0.2)
        dem = client.post("/dems", params={"sample": "valley"}).raise_for_status().json()
        for what, (path, body) in attack_bodies(dem).items():
            with attacked(str(client.base_url), path, body, Path(folder)):
                times_s = health_times_s(client, seconds)
            median_s, p99_s, worst_s = np.percentile(times_s, [50.0, 99.0, 100.0]).tolist()
            told = f"POST {path}, {len(body):,} bytes: {what}"
            cells = (told, str(len(times_s)), duration(median_s), duration(p99_s), duration(worst_s))
            rows.append(Row(cells, f"p99 ≤ {duration(TARGET_S)}", p99_s <= TARGET_S))
    return Table("GET /health under attack", ("what is sent", "asked", "median", "p99", "worst"), rows, NOTE)


def attack_bodies(dem: dict[str, Any]) -> dict[str, tuple[str, bytes]]:
    """(path, body) by what is bad about it; each would take, or once took, long for its size."""
    bounds = dem["bounds_of_posts_m"]
    east_m, north_m = (bounds["west"] + bounds["east"]) / 2, (bounds["south"] + bounds["north"]) / 2
    rng = np.random.default_rng(14)
    places_m, ranges_m = rng.uniform(-500.0, 500.0, (32, 3)), rng.uniform(1.0, 900.0, 32)
    here = {"east_m": east_m, "north_m": north_m}
    corners = [
        {"east_m": east_m + round(0.001 * n, 3), "north_m": north_m + round(100.0 * (n % 2), 1)} for n in range(9_000)
    ]
    points = [[east_m, north_m, 5000.0]] * 90_000
    attacks: dict[str, tuple[str, Any]] = {
        "32 anchors whose ranges contradict one another": (
            "/detections",
            {
                "anchors": [_detector_anchor(n, place.tolist()) for n, place in enumerate(places_m)],
                "ranges": [{"anchor_id": f"A{n}", "range_m": round(r, 1)} for n, r in enumerate(ranges_m)],
            },
        ),
        "anchors without end": ("/visibility-maps", {"dem_id": dem["id"], "anchors": _anchors(26_000, here)}),
        "fields that are not known": ("/dop-maps", {f"f{n}": 0 for n in range(150_000)}),
        "lists in a list": ("/placements", [[]] * 500_000),
        "polygons of many corners": (
            "/paths",
            {"dem_id": dem["id"], "start": here, "goals": [here], "no_go": [{"ring": corners}] * 4},
        ),
        "anchors of bubbles without end": (
            "/safety-bubbles",
            {"dem_id": dem["id"], "anchors": _anchors(80_000, here), "points_m": points[:2]},
        ),
        "points of bubbles": (
            "/safety-bubbles",
            {"dem_id": dem["id"], "points_m": points, "covariances_m2": [[4.0, 0.0, 0.0, 4.0, 0.0, 9.0]] * len(points)},
        ),
        "points that are none": ("/lines-of-sight", {"dem_id": dem["id"], "from_points_m": [0] * 2_000_000}),
        "epochs for nobody": ("/detectors/none/epochs", {"epochs": [{"time_s": 0.0, "ranges": []}] * 60_000}),
    }
    return {what: (path, json.dumps(body).encode()) for what, (path, body) in attacks.items()}


def _anchors(number: int, here: dict[str, float]) -> list[dict[str, Any]]:
    return [{"id": f"A{n}", **here, "above_ground_m": 9.0} for n in range(number)]


def _detector_anchor(number: int, place_m: list[float]) -> dict[str, Any]:
    east_m, north_m, altitude_m = (round(value, 1) for value in place_m)
    return {"id": f"A{number}", "east_m": east_m, "north_m": north_m, "altitude_m": altitude_m}


@contextmanager
def attacked(url: str, path: str, body: bytes, folder: Path, attackers: int = ATTACKERS) -> Iterator[None]:
    """The service at that address while clients send it the body again and again."""
    (folder / "attack.json").write_bytes(body)
    command = [
        sys.executable,
        "-m",
        "benchmarks.service.attacks",
        f"{url.rstrip('/')}{path}",
        str(folder / "attack.json"),
    ]
    clients = [subprocess.Popen(command, stdout=subprocess.PIPE) for _ in range(attackers)]
    try:
        for client in clients:
            assert client.stdout is not None
            client.stdout.readline()  # it is about to send
        yield
    finally:
        for client in clients:
            client.kill()
            client.wait()
            assert client.stdout is not None
            client.stdout.close()


def health_times_s(client: httpx.Client, seconds: float) -> list[float]:
    """How long each answer of /health took, asked for every 20 ms for so many seconds."""
    times_s, until_s = [], time.perf_counter() + seconds
    while time.perf_counter() < until_s:
        begin_s = time.perf_counter()
        client.get("/health").raise_for_status()
        times_s.append(time.perf_counter() - begin_s)
        time.sleep(0.02)
    return times_s


def _attack(url: str, body: bytes) -> None:
    """Send the body until somebody ends this process."""
    with httpx.Client(timeout=600.0, trust_env=False) as client:
        print("ready", flush=True)
        while True:
            answer = client.post(url, content=body, headers=JSON)
            if answer.status_code >= 500 and answer.status_code != 503:
                print(answer.text[:500], file=sys.stderr, flush=True)


if __name__ == "__main__":
    _attack(sys.argv[1], Path(sys.argv[2]).read_bytes())
