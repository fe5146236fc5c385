"""A process of its own for each sampled plan, as its caller sees it.

OMPL holds the interpreter's lock while it solves, and a seed takes effect once in the life of a process; so each plan
gets a fresh one. It is started early, loads while the grid is searched, and is killed when the plan is stopped.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Self

import numpy as np
import numpy.typing as npt

from planning.errors import PlanningProcessError

from .sampling import SamplingTask

__all__ = ["OwnProcess"]

PACKAGE_ROOT = Path(__file__).parents[2]
# how often it is asked whether the plan was stopped
POLL_S = 0.02


class OwnProcess:
    """A fresh process that solves one task; leave it as a context, and it is gone."""

    def __init__(self) -> None:
        path = [str(PACKAGE_ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
        # -P: a folder named like one of our packages, where the caller works, must not be imported
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "planning.paths.solving"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(path)},
        )
        self._answer: dict[str, npt.NDArray[np.float64] | None] | None = None
        self._best: npt.NDArray[np.float64] | None = None
        self._heard = threading.Event()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            with contextlib.suppress(BrokenPipeError):
                pipe.close()

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def best(self) -> npt.NDArray[np.float64] | None:
        """The corners that it told last, of the best path until now."""
        return self._best

    def begin(self, task: SamplingTask) -> None:
        """Hand over the task; it is solved as soon as the process has loaded."""
        threading.Thread(target=self._talk, args=(pickle.dumps(task, protocol=5),), daemon=True).start()

    def answer(self, ended: Callable[[], bool]) -> tuple[bool, npt.NDArray[np.float64] | None]:
        """(whether it came to its end, its corners or None); raises PlanningProcessError where the process died.

        Where it was ended, the corners are the best that it had told until then.
        """
        while not self._heard.wait(POLL_S):
            if ended():
                return False, self._best
        if self._answer is None:
            code = self._process.wait()
            raise PlanningProcessError(f"The process that planned ended before its answer, with exit code {code}.")
        return True, self._answer["corners"]

    def _talk(self, task: bytes) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        # a process that is killed meanwhile leaves the answer empty
        with contextlib.suppress(OSError, EOFError, ValueError, pickle.UnpicklingError):
            self._process.stdin.write(task)
            self._process.stdin.flush()
            while "better" in (message := pickle.load(self._process.stdout)):
                self._best = message["better"]
            self._answer = message
        self._heard.set()
