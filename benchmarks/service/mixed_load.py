"""200 clients at once, each asking for something else: how long /health takes, and whether anything fails."""

from __future__ import annotations

import asyncio
import tempfile
import time
from collections import Counter
from pathlib import Path

import httpx
import numpy as np

from benchmarks.report import Row, Table, duration
from benchmarks.service.slow_clients import asked_in_turn, made_place
from service.cli.own_service import running_service

__all__ = ["mixed"]

CLIENTS = 200
TARGET_S = 0.100
NOTE = f"""\
{CLIENTS} clients at once, each asking without a pause but what the answer takes: lists, maps, layers, probes,
detections, uploads of 20 kB and new maps; /health is asked for every 50 ms beside them. Whatever is neither a success
nor 429 or 503 with Retry-After counts as an error. The clients run on the same machine and take their share of it."""


def mixed(seconds: float = 120.0) -> Table:
    """p99 of /health, and what became of the requests."""
    with tempfile.TemporaryDirectory() as folder, running_service(Path(folder)) as client:
        while (workers := client.get("/health").json()["workers"])["warm"] < workers["wanted"]:
            time.sleep(0.2)
        place = made_place(client)
        health_s: list[float] = []
        outcomes: Counter[str] = Counter()
        until_s = time.perf_counter() + seconds

        async def work(number: int) -> None:
            transport = httpx.AsyncHTTPTransport(retries=1)
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

        async def look() -> None:
            async with httpx.AsyncClient(base_url=place.url, timeout=60.0) as one:
                while time.perf_counter() < until_s:
                    begun_s = time.perf_counter()
                    (await one.get("/health")).raise_for_status()
                    health_s.append(time.perf_counter() - begun_s)
                    await asyncio.sleep(0.05)

        async def together() -> None:
            await asyncio.gather(look(), *(work(number) for number in range(CLIENTS)))

        asyncio.run(together())
    median_s, p99_s = np.percentile(health_s, [50.0, 99.0]).tolist()
    errors = sum(number for what, number in outcomes.items() if what.startswith("error"))
    told = ", ".join(f"{number:,} {what}" for what, number in outcomes.most_common())
    cells = (told, f"{len(health_s):,}", duration(median_s), duration(p99_s))
    row = Row(cells, f"p99 ≤ {duration(TARGET_S)}, 0 errors", p99_s <= TARGET_S and not errors)
    return Table("200 clients at once", ("requests", "/health", "median", "p99"), [row], NOTE)
