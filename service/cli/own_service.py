"""A service of our own for as long as it is needed: started on a free port, and stopped whatever happens."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import httpx

from service.errors import ServiceError

__all__ = ["running_service"]

# The first start on a machine compiles what has not been compiled yet.
START_MAY_TAKE_S = 180.0
ANSWER_MAY_TAKE_S = 150.0
STOP_MAY_TAKE_S = 15.0
POLL_S = 0.05
ADDRESS = re.compile(r"https?://\S+")


@contextmanager
def running_service(data: Path, settings: Mapping[str, str] | None = None) -> Iterator[httpx.Client]:
    """A client of a service that is ready for work and keeps its data in ``data``. Raises ServiceError.

    settings: what the environment does not set, as SIGHTLINE_<NAME>.
    """
    log = data / "service.log"
    command = [sys.executable, "-m", "service.cli", "serve", "--host", "127.0.0.1", "--port", "0"]
    with _leaving_when_terminated(), log.open("wb") as output:
        process = subprocess.Popen(
            [*command, "--data", str(data / "data")],
            env={**(settings or {}), **os.environ},
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
        )
        try:
            deadline_s = time.monotonic() + START_MAY_TAKE_S
            address = _address(process, log, deadline_s)
            # a proxy of the environment is for the world outside, not for ourselves
            key = os.environ.get("SIGHTLINE_KEY")
            headers = {} if key is None else {"Authorization": f"Bearer {key}"}
            with httpx.Client(base_url=address, timeout=ANSWER_MAY_TAKE_S, trust_env=False, headers=headers) as client:
                _wait_until_ready(client, process, log, deadline_s)
                yield client
        finally:
            _stop(process)


@contextmanager
def _leaving_when_terminated() -> Iterator[None]:
    """Who is told to end must not leave a service behind: SIGTERM unwinds like any other end. Main thread only."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _address(process: subprocess.Popen[bytes], log: Path, deadline_s: float) -> str:
    """Where it listens, as it says itself."""
    while True:
        said = ADDRESS.search(log.read_text(encoding="utf-8", errors="replace"))
        # the line is complete once something follows the address
        if said is not None and said.end() < log.stat().st_size:
            return said[0]
        _check_alive(process, log, deadline_s)


def _wait_until_ready(client: httpx.Client, process: subprocess.Popen[bytes], log: Path, deadline_s: float) -> None:
    while not client.get("/ready").is_success:
        _check_alive(process, log, deadline_s)


def _check_alive(process: subprocess.Popen[bytes], log: Path, deadline_s: float) -> None:
    """Wait a moment; a service that has ended or takes too long is an error with the last thing it said."""
    time.sleep(POLL_S)
    code = process.poll()
    if code is None and time.monotonic() < deadline_s:
        return
    lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    what = f"took longer than {START_MAY_TAKE_S:.0f} s to start" if code is None else f"ended with exit code {code}"
    raise ServiceError(f"The service {what}; it said last: {lines[-1] if lines else 'nothing'}")


def _stop(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(STOP_MAY_TAKE_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
