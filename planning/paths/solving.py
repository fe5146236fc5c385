"""What the process that plans does: read a task, seed OMPL, solve, tell what is better, answer. See ``own_process``."""

from __future__ import annotations

import ctypes
import os
import pickle
import signal
import sys

import numpy as np
import numpy.typing as npt

__all__ = ["main"]

PR_SET_PDEATHSIG = 1


def main() -> None:
    """Answer the one task that comes over standard input; the argument is the process that asks."""
    if sys.platform == "linux":
        # whoever asked may be killed while OMPL holds the interpreter; nobody would wait for the answer then
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != int(sys.argv[1]):  # killed before that, while this process loaded
        return
    # whatever a library prints must not get between the bytes of the answer
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)

    from ompl import util

    import planning.paths.turning  # noqa: F401 - loads the kernels while the task is still being prepared

    util.setLogLevel(util.LogLevel.LOG_NONE)
    try:
        task = pickle.load(sys.stdin.buffer)
    except EOFError:  # the plan needed no sampling after all
        return
    # 0 would mean a seed by the clock
    util.RNG.setSeed(task.seed + 1)

    def tell(corners: npt.NDArray[np.float64]) -> None:
        pickle.dump({"better": corners}, answers)
        answers.flush()

    pickle.dump({"corners": task.solve(tell)}, answers)
    answers.close()


if __name__ == "__main__":
    main()
