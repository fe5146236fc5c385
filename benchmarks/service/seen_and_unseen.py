"""What keys, logs and metrics cost: the same questions to a service with them and to one without, in turns."""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from websockets.sync.client import connect

from benchmarks.report import Row, Table, duration
from benchmarks.service.over_http import question, upload_fractal, wait_until_warm
from service.access.callers import Scope
from service.access.keys import add_key
from service.jobs.marker import claimed
from service.live.request import ANCHORS, RANGES
from tests.service.running import Server, running

__all__ = ["cost_of_being_seen"]

TARGET = 1.05
UNSEEN = "benchmarks.service.unseen"
NOTE = """\
Two services beside each other on the loopback interface, one worker each, asked the same in turns by one client; who is
first takes turns too. One demands a key, logs every request and job as JSON and counts metrics; the other has no keys,
no lines of requests, and nothing in it counts or gives ids. An epoch is a round of six ranges in three dimensions; by
POST, one a request, is the dearest way, and robots use the stream."""

Ask = Callable[[int], object]


def cost_of_being_seen(posts: int = 512, maps: int = 60, epochs: int = 2000) -> Table:
    """p50 of a warm map and of an epoch, with and without. posts: of a side of the map."""
    rows = []
    with tempfile.TemporaryDirectory() as place, ExitStack() as open_until_the_end:
        few: dict[str, Any] = {"workers": 1, "spare_workers": 0, "rehearse": "maps"}
        seen_at, unseen_at = Path(place) / "seen", Path(place) / "unseen"
        _, key = add_key(claimed(seen_at) / "keys.json", "benchmark", "default", (Scope.CALCULATE,))
        seen = open_until_the_end.enter_context(running(seen_at, log_format="json", **few))
        seen.client.headers["Authorization"] = f"Bearer {key}"
        program = [sys.executable, "-m", UNSEEN]
        unseen = open_until_the_end.enter_context(running(unseen_at, program=program, access_log=False, **few))
        for what, count, asking in (
            (f"a warm map of {posts}², 4 anchors, POST and wait", maps, lambda one: _maps(one, Path(place), posts)),
            ("an epoch over the stream", epochs, lambda one: _stream(one, key, open_until_the_end)),
            ("an epoch by POST", epochs, _posted),
        ):
            with_s, without_s = _in_turns(asking(seen), asking(unseen), count)
            ratio = with_s / without_s
            cells = (what, str(count), duration(with_s), duration(without_s), f"{ratio:.3f}")
            rows.append(Row(cells, f"≤ {TARGET}", ratio <= TARGET))
    columns = ("p50 of", "number", "with", "without", "ratio")
    return Table("What keys, logs and metrics cost", columns, rows, NOTE)


def _in_turns(one: Ask, other: Ask, count: int) -> tuple[float, float]:
    """Medians of both, seconds, after a tenth of the questions that are not counted."""
    times_s: tuple[list[float], list[float]] = [], []
    for number in range(-(count // 10), count):
        for which in (0, 1) if number % 2 else (1, 0):
            begin_s = time.perf_counter()
            (one, other)[which](number + count)
            times_s[which].append(time.perf_counter() - begin_s)
    return float(np.median(times_s[0][count // 10 :])), float(np.median(times_s[1][count // 10 :]))


def _maps(server: Server, place: Path, posts: int) -> Ask:
    dem_id = upload_fractal(server.client, place, posts)
    wait_until_warm(server.client)

    def ask(number: int) -> None:
        asked = question(dem_id, posts, number)
        answer = server.client.post("/visibility-maps", json=asked, headers={"Prefer": "wait=60"})
        if answer.status_code != 201:
            raise RuntimeError(f"A map was not made: {answer.text[:200]}")

    return ask


def _posted(server: Server) -> Ask:
    session = server.client.post("/detectors", json={"anchors": ANCHORS}).raise_for_status().headers["Location"]
    return lambda number: server.client.post(
        f"{session}/epochs", json={"epochs": [{"time_s": 0.1 * number, "ranges": RANGES}]}
    ).raise_for_status()


def _stream(server: Server, key: str, until: ExitStack) -> Ask:
    opened = server.client.post("/detectors", json={"anchors": ANCHORS}).raise_for_status().json()
    address = f"{server.url.replace('http', 'ws', 1)}{opened['links']['stream']}"
    headers = {"Authorization": f"Bearer {key}"} if "Authorization" in server.client.headers else {}
    connection = until.enter_context(connect(address, additional_headers=headers, proxy=None, compression=None))

    def ask(number: int) -> None:
        connection.send(json.dumps({"time_s": 0.1 * number, "ranges": RANGES}))
        if '"rejection":null' not in (answer := str(connection.recv())):
            raise RuntimeError(f"An epoch was not used: {answer[:200]}")

    return ask
