"""``python -m service.machine.following PARENT_PID MODULE`` is a module's ``main`` until the parent ends.

The first thing that a worker process is, before anything is imported that takes seconds: whoever is killed meanwhile
leaves no process behind.
"""

from __future__ import annotations

import ctypes
import importlib
import logging
import os
import signal
import sys
from pathlib import Path

__all__ = ["main"]

logger = logging.getLogger("sightline.worker")

PR_SET_PDEATHSIG = 1
# calculations give way to the process that answers HTTP
NICENESS = 5
# out of memory the kernel ends the process of the highest score (proc(5)): a thousandth of the memory each, plus this
OOM_SCORE = 500


def main() -> None:
    """Follow the parent, give way to it, then be the module."""
    _die_with(int(sys.argv[1]))
    os.nice(NICENESS)
    _be_killed_first()
    importlib.import_module(sys.argv[2]).main()


def _die_with(parent: int) -> None:
    """Have the kernel end this process with its parent, also when the parent is killed while we calculate."""
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(0)


def _be_killed_first() -> None:
    """Have the kernel end workers before the process that answers HTTP, when memory runs out."""
    if sys.platform == "linux":
        try:
            Path("/proc/self/oom_score_adj").write_text(str(OOM_SCORE), encoding="ascii")
        except OSError as error:
            logger.warning("out of memory, the service may be ended before its workers: %s", error)


if __name__ == "__main__":
    main()
