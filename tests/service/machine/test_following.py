"""A process that follows its parent ends with it, also while it still imports what it needs."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from tests.service.processes import has_ended

SLOW = "import os, time\nfrom pathlib import Path\nPath('{at}').write_text(str(os.getpid()))\ntime.sleep(60)\n"
PARENT = """
import os, subprocess, sys, time
words = [sys.executable, "-m", "service.machine.following", str(os.getpid()), "slow_to_import"]
subprocess.Popen(words)
time.sleep(60)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's word for it is Linux's")
def test_a_worker_that_still_imports_ends_with_its_killed_parent(tmp_path: Path) -> None:
    at = tmp_path / "pid"
    (tmp_path / "slow_to_import.py").write_text(SLOW.format(at=at))
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", ""), str(Path(__file__).parents[3])])
    parent = subprocess.Popen([sys.executable, "-c", PARENT], env={**os.environ, "PYTHONPATH": path})
    while not at.exists() or not at.read_text():
        assert parent.poll() is None
        time.sleep(0.01)
    child = psutil.Process(int(at.read_text()))
    assert not has_ended(child)
    parent.kill()
    parent.wait()
    while not has_ended(child):  # the test's own time limit ends what never ends
        time.sleep(0.01)


def test_one_whose_parent_is_gone_before_it_follows_does_nothing(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "service.machine.following", "1", "no_such_module"]
    ended = subprocess.run(words, cwd=Path(__file__).parents[3], capture_output=True, text=True)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "", "")


def test_what_follows_loads_nothing_that_takes_time() -> None:
    program = (
        "import sys, service.machine.following\nprint([n for n in ('numpy', 'pydantic', 'numba') if n in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", program], cwd=Path(__file__).parents[3], capture_output=True, text=True)
    assert run.stdout.strip() == "[]", run.stderr
