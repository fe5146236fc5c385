"""The programs in examples/ run as they stand, and the rover's client stays as short as it promises to be."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from service.cli.own_service import running_service
from tests.house.repository import ROOT

EXAMPLES = ROOT / "examples"
OURS = ("detection", "planning", "service", "terrain", "visibility", "navigation")


def ran(name: str, *arguments: str) -> str:
    command = [sys.executable, "-W", "error", str(EXAMPLES / name), *arguments]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return run.stdout


def test_every_example_is_run_here() -> None:
    assert {path.name for path in EXAMPLES.glob("*.py")} == {"rover.py", "replay.py"}


@pytest.mark.timeout(600)
def test_a_rover_drives_on_what_the_service_answers(tmp_path: Path) -> None:
    with running_service(tmp_path) as client:
        said = ran("rover.py", str(client.base_url).rstrip("/"))
    assert said.count("The map foretold: D1 ") == 5
    assert "none occluded" in said
    assert said.endswith("map doubts: 0\n")


def test_the_rover_needs_nothing_of_ours_and_fewer_than_fifty_lines() -> None:
    text = (EXAMPLES / "rover.py").read_text(encoding="utf-8")
    assert len(text.splitlines()) < 50
    assert not any(f"import {name}" in text or f"from {name}" in text for name in OURS)


def test_a_log_is_replayed_over_a_map() -> None:
    said = ran("replay.py")
    assert "occluded: A1, A2, A3" in said
    assert said.endswith("map doubts: 0\n")
