"""Many at once, full queues, full disks, and jobs that are too long or too large."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from dem_samples import sample_path
from tests.service.running import ACTIVE, Server, running
from tests.stories.grounds import long_job, short_job, upload_rough_ground

CROWD = 200


def test_of_200_requests_at_once_none_is_lost(server: Server) -> None:
    dem = server.sample("valley")

    def post(_: int) -> Any:
        return server.client.post("/visibility-maps", json=short_job(dem))

    with ThreadPoolExecutor(50) as threads:
        answers = list(threads.map(post, range(CROWD)))
    assert {answer.status_code for answer in answers} == {202}
    ids = {answer.json()["id"] for answer in answers}
    assert len(ids) == CROWD

    def idle(health: dict[str, Any]) -> bool:
        return bool(health["jobs"] == {"queued": 0, "running": 0})

    server.until("/health", idle)
    first = server.client.get("/visibility-maps", params={"limit": 200}).json()
    rest = {"visibility_maps": []}
    if first["next"] is not None:
        rest = server.client.get("/visibility-maps", params={"limit": 200, "cursor": first["next"]}).json()
    listed = [*first["visibility_maps"], *rest["visibility_maps"]]
    assert {job["id"]: job["status"] for job in listed if job["id"] in ids} == dict.fromkeys(ids, "succeeded")


def test_a_full_queue_refuses_with_503_and_loses_nothing_it_took(tmp_path: Path) -> None:
    with running(tmp_path / "data", workers=1, max_queued_jobs=4) as server:
        dem = upload_rough_ground(server, tmp_path)
        busy = server.client.post("/visibility-maps", json=long_job(dem)).headers["Location"]
        server.until(busy, lambda job: job["status"] == "running")

        def post(_: int) -> Any:
            return server.client.post("/visibility-maps", json=short_job(dem))

        with ThreadPoolExecutor(12) as threads:
            answers = list(threads.map(post, range(12)))
        taken = [answer.headers["Location"] for answer in answers if answer.status_code == 202]
        refused = [answer for answer in answers if answer.status_code != 202]
        assert 1 <= len(taken) <= 4
        for answer in refused:
            assert answer.status_code == 503
            assert int(answer.headers["Retry-After"]) > 0
            assert answer.json()["type"] == "/problems/busy"
            assert "SIGHTLINE_MAX_QUEUED_JOBS" in answer.json()["detail"]
        server.client.delete(busy)
        assert {server.until_over(job)["status"] for job in taken} == {"succeeded"}


def test_a_job_beyond_its_time_is_stopped_and_says_so(tmp_path: Path) -> None:
    with running(tmp_path / "data", workers=1, max_job_s=4) as server:
        # by its estimate it would pass; the estimate of the long job would not
        dem = upload_rough_ground(server, tmp_path)
        refused = server.client.post("/visibility-maps", json=long_job(dem))
        assert refused.status_code == 422
        assert "SIGHTLINE_MAX_JOB_S" in refused.json()["detail"]
        assert "cells" in refused.json()["detail"]
        assert "GiB of memory" in refused.json()["detail"]


def test_what_needs_too_much_memory_is_refused_with_an_estimate_before_it_starts(tmp_path: Path) -> None:
    with running(tmp_path / "data", max_worker_memory_bytes=256 * 2**20) as server:
        dem = upload_rough_ground(server, tmp_path)
        refused = server.client.post("/visibility-maps", json=short_job(dem, anchors=40))
        assert (refused.status_code, refused.json()["type"]) == (422, "/problems/limit")
        assert "4,000,000 cells x 40 anchors" in refused.json()["detail"]
        assert "SIGHTLINE_MAX_WORKER_MEMORY_BYTES" in refused.json()["detail"]
        fits = server.client.post("/visibility-maps", json=short_job(dem), headers={"Prefer": "wait=60"})
        assert fits.status_code == 201


def assert_full_disk_is_survived(server: Server, dem: dict[str, Any]) -> None:
    """A result that does not fit fails with a sentence and leaves nothing behind; one that fits is made after it."""
    too_big = server.client.post("/visibility-maps", json=short_job(dem, anchors=12), headers={"Prefer": "wait=60"})
    assert too_big.status_code == 507, too_big.text
    assert too_big.json()["type"] == "/problems/storage-full"
    assert "no space left" in too_big.json()["detail"]
    job = server.client.get(too_big.headers["Location"]).json()
    assert job["status"] == "failed"
    assert job["problem"]["type"] == "/problems/storage-full"
    assert list((server.folder / "work").iterdir()) == []
    assert list((server.folder / "results").iterdir()) == []
    fits = server.client.post("/visibility-maps", json=short_job(dem), headers={"Prefer": "wait=60"})
    assert fits.status_code == 201, fits.text
    assert server.client.get(fits.json()["layers"][0]["href"]).status_code == 200
    assert server.client.get("/health").json()["status"] == "ok"


def test_a_file_size_limit_fails_the_job_and_nothing_else(tmp_path: Path) -> None:
    with running(tmp_path / "data", max_file_bytes=2_000_000) as server:
        assert_full_disk_is_survived(server, server.sample("valley"))


def test_a_full_disk_fails_the_job_and_nothing_else(small_disk: Path) -> None:
    with running(small_disk / "data") as server:
        dem = server.sample("valley")
        assert_full_disk_is_survived(server, dem)
        # uploads do not fit either, and say so
        upload = server.client.post(
            "/dems", params={"filename": "big.tif"}, content=sample_path("jacksboro").read_bytes() + b"\0" * 8_000_000
        )
        assert (upload.status_code, upload.json()["type"]) == (507, "/problems/storage-full")
        assert list((server.folder / "incoming").iterdir()) == []
        server.until("/health", lambda health: health["store_writable"])


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 5 MB of its own."""
    with mounted(tmp_path / "disk", "5m") as disk:
        yield disk


@contextmanager
def mounted(path: Path, size: str) -> Iterator[Path]:
    path.mkdir()
    if os.geteuid() != 0:
        pytest.skip("mounting a small disk needs root")
    mount = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={size}", "sightline-test", str(path)], capture_output=True, text=True
    )
    if mount.returncode != 0:
        pytest.skip(f"a small disk cannot be mounted here: {mount.stderr.strip()}")
    try:
        yield path
    finally:
        subprocess.run(["umount", "--lazy", str(path)], check=True)


def test_health_answers_while_every_worker_is_busy(tmp_path: Path) -> None:
    with running(tmp_path / "data", workers=2) as server:
        dem = upload_rough_ground(server, tmp_path)
        jobs = [server.client.post("/visibility-maps", json=long_job(dem)).headers["Location"] for _ in range(2)]
        for job in jobs:
            server.until(job, lambda state: state["status"] == "running")
        assert {server.client.get("/health").json()["status"] for _ in range(100)} == {"ok"}
        assert all(server.client.get(job).json()["status"] in ACTIVE for job in jobs)
        for job in jobs:
            server.client.delete(job)
