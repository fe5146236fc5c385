"""Nothing finished is lost and nothing begun is forgotten: restarts, kill -9, dying workers, a second service."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path
from typing import Any

from tests.service.processes import left_after
from tests.service.running import Server, command, environment, running
from tests.stories.grounds import long_job, short_job, upload_rough_ground


def finished_map(server: Server, dem: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
    made = server.client.post("/visibility-maps", json=short_job(dem), headers={"Prefer": "wait=60"})
    assert made.status_code == 201, made.text
    return made.json(), server.client.get(made.json()["layers"][0]["href"]).content


def test_a_killed_service_leaves_no_workers_and_takes_everything_up_again(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    with running(folder, workers=1) as server:
        dem = upload_rough_ground(server, tmp_path)
        made, layer = finished_map(server, dem)
        begun = server.client.post("/visibility-maps", json=long_job(dem)).headers["Location"]
        waiting = server.client.post("/visibility-maps", json=short_job(dem)).headers["Location"]
        server.until(begun, lambda job: job["progress"] > 0.0)
        workers = server.workers
        server.kill()
        assert left_after(workers, 5.0) == []
    with running(folder, workers=1) as server:
        assert server.client.get(dem["links"]["self"]).json() == dem
        assert server.client.get(made["links"]["self"]).json() == made
        assert server.client.get(made["layers"][0]["href"]).content == layer
        again = server.until(begun, lambda job: job["status"] == "running")
        assert again["attempts"] == 2
        assert server.client.get(waiting).json()["status"] == "queued"
        server.client.delete(begun)
        assert server.until_over(waiting)["status"] == "succeeded"


def test_a_job_that_ran_at_every_kill_is_reported_as_interrupted(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    begun = ""
    for _ in range(2):
        with running(folder, workers=1) as server:
            if not begun:
                dem = upload_rough_ground(server, tmp_path)
                begun = server.client.post("/visibility-maps", json=long_job(dem)).headers["Location"]
            server.until(begun, lambda job: job["status"] == "running")
            server.kill()
    with running(folder, workers=1) as server:
        job = server.client.get(begun).json()
        assert job["status"] == "interrupted"
        assert job["problem"]["type"] == "/problems/interrupted"
        assert "started 2 times" in job["problem"]["detail"]


def test_an_orderly_restart_takes_up_what_ran_without_blaming_it(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    with running(folder, workers=1) as server:
        dem = upload_rough_ground(server, tmp_path)
        made, layer = finished_map(server, dem)
        begun = server.client.post("/visibility-maps", json=long_job(dem)).headers["Location"]
        server.until(begun, lambda job: job["status"] == "running")
        workers = server.workers
        server.stop()
        assert left_after(workers, 1.0) == []
        assert list((folder / "work").iterdir()) == []
    with running(folder, workers=1) as server:
        assert server.client.get(made["layers"][0]["href"]).content == layer
        assert server.until(begun, lambda job: job["status"] == "running")["attempts"] == 1


def test_a_job_whose_worker_is_killed_is_tried_again_then_reported_and_the_service_goes_on(tmp_path: Path) -> None:
    with running(tmp_path / "data", workers=1) as server:
        dem = upload_rough_ground(server, tmp_path)
        begun = server.client.post("/visibility-maps", json=long_job(dem)).headers["Location"]
        for attempt in (1, 2):
            server.until(begun, lambda job, n=attempt: job["status"] == "running" and job["attempts"] == n)
            server.kill_workers()
        job = server.until_over(begun)
        assert job["status"] == "interrupted"
        assert "worker process ended" in job["problem"]["detail"]
        finished_map(server, dem)
        assert server.until("/health", lambda health: health["workers"]["warm"] == health["workers"]["wanted"])


def test_killing_workers_also_while_they_start_leaves_no_job_behind(tmp_path: Path) -> None:
    with running(tmp_path / "data", workers=1) as server:
        dem = upload_rough_ground(server, tmp_path)
        long = server.client.post("/visibility-maps", json=long_job(dem)).headers["Location"]
        server.until(long, lambda job: job["status"] == "running")
        short = server.client.post("/visibility-maps", json={**long_job(dem), "mode": "fast"}).headers["Location"]
        for _ in range(3):
            server.kill_workers()
            server.until("/health", lambda health: health["workers"]["warm"] == 0, 10.0)
        server.until(long, lambda job: job["status"] == "running" and job["attempts"] == 2)
        server.kill_workers()
        assert server.until_over(long)["status"] == "interrupted"
        assert server.until_over(short)["status"] == "succeeded"


def test_ctrl_c_in_the_terminal_ends_it_without_noise(tmp_path: Path) -> None:
    with running(tmp_path / "data") as server:
        workers = server.workers
        # a terminal sends it to the service and its workers alike
        os.killpg(server.process.pid, signal.SIGINT)
        server.process.wait(20)
        assert left_after(workers, 1.0) == []
        assert "Traceback" not in server.log.read_text()


def test_a_second_service_on_the_same_folder_leaves_with_one_sentence(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    with running(folder) as server:
        second = subprocess.run(command(), env=environment(folder), capture_output=True, text=True, timeout=60)
        assert second.returncode == 2
        assert second.stderr.strip().splitlines() == [
            f"The data folder {folder} is in use by another Sightline process; stop that one or choose another folder "
            "(SIGHTLINE_DATA_FOLDER)."
        ]
        assert second.stdout == ""
        assert server.client.get("/health").json()["status"] == "ok"


def test_a_port_that_is_taken_is_told_with_one_sentence(tmp_path: Path) -> None:
    with running(tmp_path / "data") as server:
        port = server.url.rpartition(":")[2]
        second = subprocess.run(
            command(), env=environment(tmp_path / "other", port=port), capture_output=True, text=True, timeout=60
        )
        assert second.returncode == 2
        assert f"cannot listen on 127.0.0.1 port {port}" in second.stderr
        assert len(second.stderr.strip().splitlines()) == 1
