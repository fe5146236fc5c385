"""A real service in its own process, on a free loopback port, for tests that speak HTTP to it."""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import psutil

# The first start on a machine compiles the kernels.
START_MAY_TAKE_S = 240.0
ANSWER_MAY_TAKE_S = 120.0
ACTIVE = ("queued", "running")


@dataclass
class Server:
    """A running service: its process, where it listens, a client, and what it says."""

    process: subprocess.Popen[bytes]
    url: str
    client: httpx.Client
    folder: Path
    log: Path

    @property
    def workers(self) -> list[psutil.Process]:
        return psutil.Process(self.process.pid).children()

    def kill_workers(self) -> None:
        """All that there are; one may have ended by itself since."""
        for worker in self.workers:
            with suppress(psutil.NoSuchProcess):
                worker.kill()

    @property
    def said(self) -> list[str]:
        """Lines of its log that are whole; the last may be being written."""
        return self.log.read_text().rpartition("\n")[0].splitlines()

    def kill(self) -> None:
        """As kill -9 or a power cut would."""
        self.process.kill()
        self.process.wait()

    def stop(self) -> int:
        self.process.terminate()
        return self.process.wait(30)

    def upload(self, path: Path, **query: Any) -> dict[str, Any]:
        with path.open("rb") as file:
            answer = self.client.post("/dems", files={"file": (path.name, file)}, params=query)
        assert answer.status_code in (200, 201), answer.text
        return dict(answer.json())

    def sample(self, name: str = "jacksboro") -> dict[str, Any]:
        answer = self.client.post("/dems", params={"sample": name})
        assert answer.status_code in (200, 201), answer.text
        return dict(answer.json())

    def until_over(self, path: str, may_take_s: float = 120.0) -> dict[str, Any]:
        """Poll a job until it neither waits nor runs."""
        return self.until(path, lambda job: job["status"] not in ACTIVE, may_take_s)

    def until(self, path: str, holds: Any, may_take_s: float = 120.0) -> dict[str, Any]:
        deadline_s = time.monotonic() + may_take_s
        while True:
            job = self.client.get(path).json()
            if holds(job):
                return dict(job)
            assert time.monotonic() < deadline_s, f"{path} is still {job}"
            time.sleep(0.02)


def environment(folder: Path, **settings: Any) -> dict[str, str]:
    """settings: None leaves one to the service."""
    given = {"data_folder": folder, "port": 0, "workers": 2, "file_workers": 1, "spare_workers": 1, **settings}
    # one thread per worker: long jobs take long on every machine, and tests leave some of it to others
    threads = {"NUMBA_NUM_THREADS": "1"}
    return {
        **os.environ,
        **threads,
        **{f"SIGHTLINE_{name.upper()}": str(value) for name, value in given.items() if value is not None},
    }


def command() -> list[str]:
    return [sys.executable, "-m", "service.cli", "serve"]


@contextmanager
def running(
    folder: Path,
    *,
    max_file_bytes: int | None = None,
    descriptors: int | None = None,
    groups: Sequence[Path] = (),
    await_worker: bool = True,
    program: Sequence[str] = (),
    **settings: Any,
) -> Iterator[Server]:
    """A service on that data folder, ready for work unless its workers are not awaited.

    max_file_bytes: as if the disk were full beyond that. descriptors: how many it may open. groups: folders of control
    groups that it is put into. program: started in place of the service.
    """

    def limit() -> None:
        for group in groups:
            (group / "cgroup.procs").write_text(str(os.getpid()))
        if max_file_bytes is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (max_file_bytes, max_file_bytes))
        if descriptors is not None:
            resource.setrlimit(resource.RLIMIT_NOFILE, (descriptors, descriptors))

    folder.parent.mkdir(parents=True, exist_ok=True)
    log = folder.parent / f"{folder.name}.log"
    with log.open("ab") as errors:
        process = subprocess.Popen(
            program or command(),
            env=environment(folder, **settings),
            stdout=subprocess.PIPE,
            stderr=errors,
            preexec_fn=limit,
            start_new_session=True,
        )
    try:
        assert process.stdout is not None
        said = process.stdout.readline().decode()
        found = re.search(r"http://\S+", said)
        assert found is not None, f"the service said {said!r} and logged {log.read_text()[-2000:]}"
        with httpx.Client(base_url=found[0], timeout=ANSWER_MAY_TAKE_S, trust_env=False) as client:
            if await_worker:
                _wait_until_ready(client, log)
            yield Server(process, found[0], client, folder, log)
    finally:
        if process.poll() is None:
            process.terminate()
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        if process.stdout is not None:
            process.stdout.close()


def _wait_until_ready(client: httpx.Client, log: Path) -> None:
    deadline_s = time.monotonic() + START_MAY_TAKE_S
    while not client.get("/ready").is_success:
        assert time.monotonic() < deadline_s, f"never ready; it logged {log.read_text()[-2000:]}"
        time.sleep(0.05)
