"""What an operator decides about storage: results go by age, pinned ones stay, and a full disk can be emptied."""

from __future__ import annotations

import time
from datetime import datetime
from pathlib import Path
from typing import Any

import httpx

from tests.service.running import Server, running
from tests.stories.grounds import short_job
from tests.stories.test_crowds_and_limits import mounted


def a_map(server: Server, dem: dict[str, Any], anchors: int) -> httpx.Response:
    wait = {"Prefer": "wait=60"}
    return server.client.post("/visibility-maps", json=short_job(dem, anchors), headers=wait, timeout=120.0)


def test_results_go_when_they_said_and_pinned_ones_stay(tmp_path: Path) -> None:
    with running(tmp_path / "data", keep_results_s=15) as server:
        dem = server.sample("valley")
        pinned = a_map(server, dem, 1)
        assert pinned.status_code == 201, pinned.text
        kept = server.client.put(f"{pinned.headers['Location']}/pin")
        assert (kept.status_code, kept.json()["pinned"], kept.json()["expires_at"]) == (200, True, None)
        other = a_map(server, dem, 2)
        assert other.status_code == 201, other.text
        told = other.json()
        finished, expires = (datetime.fromisoformat(told[name]) for name in ("finished_at", "expires_at"))
        assert (expires - finished).total_seconds() == 15.0
        deadline_s = time.monotonic() + 60.0
        while server.client.get(other.headers["Location"]).status_code != 404:
            assert time.monotonic() < deadline_s
            time.sleep(0.5)
        assert datetime.now(expires.tzinfo) >= expires
        assert server.client.get(pinned.headers["Location"]).json()["status"] == "succeeded"
        assert len(list((server.folder / "results").iterdir())) == 1
        unpinned = server.client.delete(f"{pinned.headers['Location']}/pin")
        assert not unpinned.json()["pinned"]
        assert server.client.put("/visibility-maps/unknown/pin").status_code == 404
        storage = server.client.get("/about").json()["storage"]
        assert storage["keep_results_s"] == 15.0


def test_a_disk_that_is_full_to_the_last_byte_says_so_and_can_be_emptied(tmp_path: Path) -> None:
    with mounted(tmp_path / "disk", "48m") as disk, running(disk / "data") as server:
        dem = server.sample("valley")
        made = a_map(server, dem, 1)
        assert made.status_code == 201
        assert (server.folder / "reserve").is_file()
        filler = disk / "filler"
        with filler.open("wb", buffering=0) as file:
            try:
                while file.write(b"\0" * 65536) == 65536:
                    pass
            except OSError:
                pass
        deadline_s = time.monotonic() + 30.0
        while (ready := server.client.get("/ready")).status_code == 200:
            assert time.monotonic() < deadline_s
            time.sleep(0.2)
        assert (ready.status_code, ready.json()["type"]) == (503, "/problems/busy")
        refused = a_map(server, dem, 2)
        assert (refused.status_code, refused.json()["type"]) == (507, "/problems/storage-full")
        assert server.client.delete(made.headers["Location"]).status_code == 204
        assert list((server.folder / "results").iterdir()) == []
        assert server.client.delete(f"/dems/{dem['id']}").status_code == 204
        filler.unlink()
        while server.client.get("/ready").status_code != 200:
            assert time.monotonic() < deadline_s + 30.0
            time.sleep(0.2)
        assert (server.folder / "reserve").is_file()
        again = a_map(server, server.sample("valley"), 3)
        assert again.status_code == 201
