"""Whether processes that a test did not start itself have ended."""

from __future__ import annotations

import time
from collections.abc import Sequence

import psutil


def has_ended(process: psutil.Process) -> bool:
    """Whether it no longer runs: it is gone, or dead and nobody has buried it yet."""
    try:
        return not process.is_running() or process.status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


def left_after(processes: Sequence[psutil.Process], seconds: float) -> list[psutil.Process]:
    """Which of them still run after that long; empty as soon as none does."""
    until_s = time.monotonic() + seconds
    while True:
        alive = [one for one in processes if not has_ended(one)]
        if not alive or time.monotonic() > until_s:
            return alive
        time.sleep(0.02)
