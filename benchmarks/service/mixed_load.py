"""200 clients at once, each asking for something else: how long /health takes, and whether anything fails."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import httpx
import numpy as np

from benchmarks.report import Row, Table, duration
from benchmarks.service.attacks import health_times_s
from benchmarks.service.slow_clients import asked_in_turn, made_place
from service.cli.own_service import running_service

__all__ = ["mixed"]

CLIENTS = 200
TARGET_S = 0.100
NOTE = f"""\
{CLIENTS} clients at once, each asking without a pause but what the answer takes: lists, maps, layers, probes,
detections, uploads of 20 kB and new maps; a process of its own asks for /health every 20 ms beside them, so that it is
the service that is measured and not the clients' own queue. Whatever is neither a success nor 429 or 503 with
Retry-After counts as an error. The clients run on the same machine and take their share of it."""


def mixed(seconds: float = 120.0) -> Table:
    """p99 of /health, and what became of the requests."""
    with tempfile.TemporaryDirectory() as folder, running_service(Path(folder)) as client:
        while (workers := client.get("/health").json()["workers"])["warm"] < workers["wanted"]:
            time.sleep(0.2)
        place = made_place(client)
        outcomes: Counter[str] = Counter()
        until_s = time.perf_counter() + seconds

        async def work(number: int) -> None:
            # there is no TLS, and what it would need takes longer to make than many requests
            transport = httpx.AsyncHTTPTransport(retries=1, verify=False)
            async with httpx.AsyncClient(base_url=place.url, transport=transport, timeout=60.0) as one:
                asks = asked_in_turn(one, place, maps=True)
                turn = number
                while time.perf_counter() < until_s:
                    _, right, ask = asks[turn % len(asks)]
                    turn += 1
                    try:
                        answer = await ask()
                    except httpx.HTTPError as error:
                        outcomes[f"error: {type(error).__name__}"] += 1
                        continue
                    later = answer.status_code in (429, 503) and "Retry-After" in answer.headers
                    told = "success" if answer.status_code in right else f"{answer.status_code}"
                    outcomes[told if told == "success" or later else f"error: {told}"] += 1
                    if later:
                        await asyncio.sleep(1.0)

        async def together() -> None:
            await asyncio.gather(*(work(number) for number in range(CLIENTS)))

        looks = [sys.executable, "-m", "benchmarks.service.mixed_load", place.url, str(seconds)]
        with subprocess.Popen(looks, stdout=subprocess.PIPE, text=True) as looking:
            asyncio.run(together())
            told, _ = looking.communicate()
        health_s: list[float] = json.loads(told)
    median_s, p99_s = np.percentile(health_s, [50.0, 99.0]).tolist()
    errors = sum(number for what, number in outcomes.items() if what.startswith("error"))
    told = ", ".join(f"{number:,} {what}" for what, number in outcomes.most_common())
    cells = (told, f"{len(health_s):,}", duration(median_s), duration(p99_s))
    row = Row(cells, f"p99 ≤ {duration(TARGET_S)}, 0 errors", p99_s <= TARGET_S and not errors)
    return Table("200 clients at once", ("requests", "/health", "median", "p99"), [row], NOTE)


def _look(url: str, seconds: float) -> None:
    """Print how long each answer of /health took."""
    with httpx.Client(base_url=url, timeout=60.0, trust_env=False) as client:
        print(json.dumps(health_times_s(client, seconds)))


if __name__ == "__main__":
    _look(sys.argv[1], float(sys.argv[2]))
