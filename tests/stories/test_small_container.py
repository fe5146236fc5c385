"""A service in a control group of 1.5 GB and one processor: it tells its limits, and work never ends the server."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx
import pytest

from tests.service.running import Server, running
from tests.stories.grounds import long_job, short_job, upload_rough_ground

LIMIT_BYTES = 1_500_000_000
VERSION_1 = Path("/sys/fs/cgroup")


@pytest.fixture
def groups() -> Iterator[list[Path]]:
    """Groups of 1.5 GB and one processor; taken away when all that was in them is gone."""
    name, made = f"sightline-test-{os.getpid()}", []
    files = {
        "memory": {"memory.limit_in_bytes": LIMIT_BYTES},
        "cpu": {"cpu.cfs_period_us": 100_000, "cpu.cfs_quota_us": 100_000},
    }
    try:
        for controller, limits in files.items():
            group = VERSION_1 / controller / name
            if not group.parent.is_dir():
                pytest.skip("no control groups of version 1 here")
            group.mkdir()
            made.append(group)
            for file, number in limits.items():
                (group / file).write_text(str(number))
        yield made
    except PermissionError:
        pytest.skip("control groups cannot be made here")
    finally:
        for group in made:
            for _ in range(100):
                if not (group / "cgroup.procs").read_text():
                    break
                time.sleep(0.05)
            group.rmdir()


def asked_at_once(server: Server, dem: dict[str, str]) -> list[int]:
    """Maps, pictures of them, uploads and probes by six clients; the statuses of all answers."""

    def client(number: int) -> list[int]:
        told = []
        with httpx.Client(base_url=server.url, timeout=120.0, trust_env=False) as own:
            for turn in range(2):
                asked = short_job(dem, anchors=1 + (number + turn) % 4)
                answer = own.post("/visibility-maps", json=asked, headers={"Prefer": "wait=60"})
                told.append(answer.status_code)
                if answer.status_code == 201:
                    told += [own.get(layer["href"]).status_code for layer in answer.json()["layers"][:4]]
        return told

    with ThreadPoolExecutor(6) as pool:
        return [status for told in pool.map(client, range(6)) for status in told]


def test_the_limits_are_told_and_the_server_outlives_all_work(tmp_path: Path, groups: list[Path]) -> None:
    settings = dict.fromkeys(("workers", "file_workers", "spare_workers"))
    with running(tmp_path / "data", groups=groups, **settings) as server:
        about = server.client.get("/about").json()
        assert (about["cores"], about["workers"], about["file_workers"], about["spare_workers"]) == (1, 1, 1, 0)
        assert LIMIT_BYTES - 4096 <= about["memory"]["available_bytes"] <= LIMIT_BYTES
        assert (about["memory"]["set_by"], about["memory"]["fits"]) == ("control group", True)
        assert "MiB of memory (control group), 1 core;" in server.log.read_text()
        server.until("/health", lambda health: health["workers"] == {"warm": 2, "wanted": 2})
        scores = [int(Path(f"/proc/{worker.pid}/oom_score_adj").read_text()) for worker in server.workers]
        assert all(score > int(Path(f"/proc/{server.process.pid}/oom_score_adj").read_text()) for score in scores)

        dem = upload_rough_ground(server, tmp_path)
        too_much = server.client.post("/visibility-maps", json=long_job(dem))
        assert too_much.status_code == 422
        statuses = asked_at_once(server, dem)
        assert set(statuses) <= {200, 201, 202, 503}
        assert statuses.count(201) >= 6
        assert server.process.poll() is None
        assert server.client.get("/ready").status_code == 200
        most = int((groups[0] / "memory.max_usage_in_bytes").read_text())
        assert most <= LIMIT_BYTES
        events = dict(line.split() for line in (groups[0] / "memory.oom_control").read_text().splitlines())
        assert events["oom_kill"] == "0"
