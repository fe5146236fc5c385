"""Disks that take no more files or none at all, and clocks that are 400 days off: nothing is lost or half there."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.service.folders import contents
from tests.service.running import Server, command, environment, running
from tests.stories.grounds import short_job
from tests.stories.test_crowds_and_limits import mounted
from tests.stories.test_keeping_results import a_map

QUICK: dict[str, Any] = {"workers": 1, "rehearse": "maps"}
DAYS_400_S = 400 * 86_400.0


def unfinished(server: Server) -> list[Path]:
    return [path for name in ("work", "incoming") for path in (server.folder / name).iterdir()]


def fill(folder: Path) -> None:
    """Make files for as long as there can be more."""
    folder.mkdir()
    for number in itertools.count():
        (folder / str(number)).touch()


def test_a_disk_on_which_no_file_can_be_made_any_more_is_told_and_can_be_emptied(tmp_path: Path) -> None:
    with mounted(tmp_path / "disk", "64m,nr_inodes=4000") as disk, running(disk / "data", **QUICK) as server:
        dem = server.sample("valley")
        made = a_map(server, dem, 1)
        layer = made.json()["layers"][0]["href"]
        drawn = server.client.get(layer)
        assert (made.status_code, drawn.status_code) == (201, 200)
        fillers = disk / "fillers"
        with pytest.raises(OSError, match="No space left"):
            fill(fillers)
        refused = a_map(server, dem, 2)
        assert (refused.status_code, refused.json()["type"]) == (507, "/problems/storage-full"), refused.text
        server.until("/ready", lambda told: told.get("type") == "/problems/busy", 30.0)
        assert server.client.get(layer).content == drawn.content
        assert server.client.delete(made.headers["Location"]).status_code == 204
        for filler in fillers.iterdir():
            filler.unlink()
        server.until("/ready", lambda told: told.get("status") == "ready", 30.0)
        assert a_map(server, dem, 3).status_code == 201
        assert unfinished(server) == []


def test_a_folder_that_may_only_be_read_is_refused_in_one_sentence_and_is_whole_after_that(tmp_path: Path) -> None:
    with mounted(tmp_path / "disk", "64m") as disk:
        folder = disk / "data"
        with running(folder, **QUICK) as server:
            made = a_map(server, server.sample("valley"), 1)
            server.stop()
        before = contents(folder)
        subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
        refused = subprocess.run(command(), env=environment(folder), capture_output=True, text=True, timeout=60)
        assert (refused.returncode, refused.stdout) == (2, "")
        (sentence,) = refused.stderr.strip().splitlines()
        assert "Read-only file system" in sentence
        assert contents(folder) == before
        subprocess.run(["mount", "-o", "remount,rw", str(disk)], check=True)
        with running(folder, **QUICK) as server:
            assert server.client.get(made.headers["Location"]).json() == made.json()
            assert server.client.get(made.json()["layers"][0]["href"]).status_code == 200


# a service whose clock is off by as many seconds as a file says
CLOCK = """
import time, pathlib
right, off = time.time, pathlib.Path({at!r})
time.time = lambda: right() + float(off.read_text())
from service.cli import main
main()
"""


def test_a_clock_that_jumps_by_400_days_and_back_loses_nothing(tmp_path: Path) -> None:
    off = tmp_path / "off"

    def put(seconds: float) -> None:
        (tmp_path / "new").write_text(str(seconds))
        os.replace(tmp_path / "new", off)  # noqa: PTH105 - at once, for the service reads it all the time

    put(0.0)
    program = [sys.executable, "-c", CLOCK.format(at=str(off)), "serve"]
    with running(tmp_path / "data", program=program, **QUICK) as server:
        dem, made = server.sample("valley"), []
        for number, seconds in enumerate((0.0, DAYS_400_S, -DAYS_400_S, 0.0), 1):
            put(seconds)
            answer = a_map(server, dem, number)
            assert answer.status_code == 201, answer.text
            made.append(answer.json())
        # one that is under way when the clock is put back
        put(DAYS_400_S)
        job = server.client.post("/visibility-maps", json=short_job(dem, 5)).headers["Location"]
        put(-DAYS_400_S)
        made.append(server.until_over(job))
        assert made[-1]["status"] == "succeeded"
        layers = [server.client.get(one["layers"][0]["href"]).content for one in made]
        server.kill()
    with running(tmp_path / "data", program=program, **QUICK) as server:
        assert [server.client.get(one["links"]["self"]).json() for one in made] == made
        assert [server.client.get(one["layers"][0]["href"]).content for one in made] == layers
        listed, cursor = [], None
        while cursor != "":
            query = {"limit": "1", **({} if cursor is None else {"cursor": cursor})}
            page = server.client.get("/visibility-maps", params=query).json()
            listed += [one["id"] for one in page["visibility_maps"]]
            cursor = page["next"] or ""
        assert sorted(listed) == sorted(one["id"] for one in made)
        assert server.client.get("/health").json()["quarantined"] == 0
        assert unfinished(server) == []
