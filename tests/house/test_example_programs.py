"""The programs in examples/ run as they stand, and the rover's client stays as short as it promises to be."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import threading
from pathlib import Path
from types import ModuleType

import pytest

from service.cli.own_service import running_service
from service.live.request import ANCHORS, RANGES
from tests.house.repository import ROOT

EXAMPLES = ROOT / "examples"
OURS = ("detection", "planning", "service", "terrain", "visibility", "navigation")


def ran(name: str, *arguments: str) -> str:
    command = [sys.executable, "-W", "error", str(EXAMPLES / name), *arguments]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return run.stdout


def test_every_example_is_run_here() -> None:
    assert {path.name for path in EXAMPLES.glob("*.py")} == {"dashboard.py", "replay.py", "ros2_node.py", "rover.py"}


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


def loaded(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.timeout(600)
def test_the_dashboard_shows_what_another_client_sends(tmp_path: Path) -> None:
    with running_service(tmp_path) as client:
        detector = client.post("/detectors", json={"anchors": ANCHORS}).raise_for_status().json()
        url = str(client.base_url).rstrip("/")
        command = [sys.executable, "-W", "error", str(EXAMPLES / "dashboard.py"), url, detector["id"], "3"]
        watching = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        killer = threading.Timer(120.0, watching.kill)
        killer.start()
        try:
            assert watching.stdout is not None
            assert watching.stdout.readline() == f"watching {detector['id']}\n"
            for second in range(3):
                epochs = {"epochs": [{"time_s": float(second), "ranges": RANGES}]}
                client.post(detector["links"]["epochs"], json=epochs).raise_for_status()
            said, problems = watching.communicate()
        finally:
            killer.cancel()
            watching.kill()
    assert (watching.returncode, problems) == (0, "")
    assert len(said.splitlines()) == 3
    assert said.count("degraded") == 3
    assert said.count("\033[31mD4 ") == 3, "occluded is red"
    assert all(f"\033[32m{anchor['id']} " in said for anchor in ANCHORS if anchor["id"] != "D4")
