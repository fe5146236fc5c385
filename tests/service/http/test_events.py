"""A calculation told as server-sent events: from the first to the last, to several at once, and when it is deleted."""

from __future__ import annotations

import json
import threading
from pathlib import Path
from typing import Any

import numpy as np

from tests.service.running import Server
from tests.stories.grounds import long_job, short_job


def events(server: Server, path: str) -> list[tuple[str, dict[str, Any]]]:
    """(name, data) of every event until the service ends the stream."""
    found: list[tuple[str, dict[str, Any]]] = []
    with server.client.stream("GET", f"{path}/events") as answer:
        assert answer.status_code == 200
        assert answer.headers["content-type"].startswith("text/event-stream")
        name = ""
        for line in answer.iter_lines():
            if line.startswith("event: "):
                name = line.removeprefix("event: ")
            elif line.startswith("data: "):
                found.append((name, json.loads(line.removeprefix("data: "))))
    return found


def test_what_is_over_is_told_in_one_event(server: Server, jacksboro: dict[str, Any]) -> None:
    job = server.client.post("/visibility-maps", json=short_job(jacksboro), headers={"Prefer": "wait=60"}).json()
    path = job["links"]["self"]
    assert events(server, path) == [("over", {"status": "succeeded", "progress": 1.0, "self": path})]
    assert server.client.head(f"{path}/events").status_code == 200
    assert server.client.get("/visibility-maps/none/events").status_code == 404


def test_two_who_watch_are_told_the_same_end_and_rising_shares(server: Server, tmp_path: Path) -> None:
    heights_m = np.random.default_rng(7).normal(100.0, 20.0, (1400, 1400)).astype(np.float32)
    # whole metres, packed, are within the limit of uploads here
    np.savez_compressed(tmp_path / "rough.npz", heights_m=heights_m.round(), cell_east_m=10.0, cell_north_m=10.0)
    dem = server.upload(tmp_path / "rough.npz")
    job = server.client.post("/visibility-maps", json=long_job(dem)).json()
    path = job["links"]["self"]
    seen: list[list[tuple[str, dict[str, Any]]]] = []
    watching = [threading.Thread(target=lambda: seen.append(events(server, path))) for _ in range(2)]
    for one in watching:
        one.start()
    server.until(path, lambda now: now["progress"] > 0.0)
    assert server.client.delete(path).status_code == 200
    for one in watching:
        one.join(60)
    assert len(seen) == 2
    for told in seen:
        assert {name for name, _ in told[:-1]} <= {"progress"}
        shares = [data["progress"] for _, data in told[:-1]]
        assert shares == sorted(shares)
        assert told[-1][0] == "over"
        assert told[-1][1]["status"] == "cancelled"
