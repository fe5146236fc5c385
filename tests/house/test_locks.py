"""What is installed is locked: every package of the product with version and hash; a rover's few are enough for it."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from tests.house.repository import ROOT, pyproject

LOCKED = re.compile(r"^([A-Za-z0-9._-]+)==([^ \\;]+)(?: ;[^\\]*)? \\$", re.MULTILINE)
HASHES = re.compile(r"(?:    --hash=sha256:[0-9a-f]{64}(?: \\)?\n)+")


def locked(name: str) -> dict[str, str]:
    text = (ROOT / "locks" / name).read_text(encoding="utf-8")
    return {found[1].lower().replace("_", "-").replace(".", "-"): found[2] for found in LOCKED.finditer(text)}


def asked(requirements: list[str]) -> list[Requirement]:
    return [Requirement(text) for text in requirements]


@pytest.mark.parametrize("name", ["product.txt", "tests.txt", "rover.txt", "build.txt"])
def test_every_package_of_a_lock_has_hashes_and_none_comes_from_a_named_place(name: str) -> None:
    text = (ROOT / "locks" / name).read_text(encoding="utf-8")
    body = "".join(line for line in text.splitlines(keepends=True) if not line.startswith("#"))
    assert locked(name)
    assert HASHES.sub("", LOCKED.sub("", body)).strip() == ""
    assert len(HASHES.findall(body)) == len(LOCKED.findall(body))


@pytest.mark.parametrize(
    ("name", "extras"), [("product.txt", ("postgres", "rtk", "telemetry")), ("tests.txt", ("test", "bench"))]
)
def test_a_lock_holds_what_the_project_asks_for(name: str, extras: tuple[str, ...]) -> None:
    project = pyproject()["project"]
    wanted = asked(
        [*project["dependencies"], *(text for extra in extras for text in project["optional-dependencies"][extra])]
    )
    found = locked(name)
    for requirement in wanted:
        if requirement.name == project["name"]:  # an extra that names others of the same project
            continue
        key = requirement.name.lower().replace("_", "-")
        assert key in found, f"run make lock: {requirement} is not in locks/{name}"
        assert requirement.specifier.contains(found[key]), f"run make lock: {requirement} is locked as {found[key]}"


def test_locks_agree_with_each_other_and_a_rover_has_little() -> None:
    product, tests, rover = locked("product.txt"), locked("tests.txt"), locked("rover.txt")
    assert product.items() <= tests.items()
    assert rover.items() <= product.items()
    assert set(rover) == {"llvmlite", "numba", "numpy"}


ON_A_ROVER = """
import sys
from importlib.abc import MetaPathFinder
allowed = {"llvmlite", "numba", "numpy", "compiled", "gnss", "detection", "navigation"}
class Absent(MetaPathFinder):
    def find_spec(self, name, path, target=None):
        top = name.partition(".")[0]
        if top in allowed or top in sys.stdlib_module_names or top.startswith("_") or "numba" in top:
            return None
        raise ModuleNotFoundError(f"{top} is not installed", name=top)
sys.meta_path.insert(0, Absent())
import math
import detection, navigation
places = {"D1": (0, 0, 120), "D2": (400, 30, 60), "D3": (380, 420, 140), "D4": (-20, 390, 80), "D5": (240, 150, 160)}
anchors = [detection.RangingAnchor(name, *place) for name, place in places.items()]
detector = detection.Detector(anchors, detection.DetectorSettings(range_sigma_m=0.1, max_speed_m_per_s=3.0))
for second in range(4):
    rover = (150.0 + second, 160.0, 2.0)
    ranges = [detection.RangeMeasurement(name, math.dist(place, rover)) for name, place in places.items()]
    told = detector.process(detection.RangeEpoch(float(second), tuple(ranges)))
print(told.classification, navigation.nees([1.0, 0.0], [[1.0, 0.0], [0.0, 1.0]]))
"""


def test_detection_and_navigation_run_with_what_the_rover_lock_installs(tmp_path: Path) -> None:
    for package in ("compiled", "gnss", "detection", "navigation"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    command = [sys.executable, "-P", "-c", ON_A_ROVER]
    environment = {"PATH": "/usr/bin:/bin", "PYTHONPATH": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    ended = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.split() == ["none", "1.0"]


def test_the_image_installs_the_lock_and_nothing_else() -> None:
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    installs = re.findall(r"pip install (.*?)(?: \\)?$", text, re.MULTILINE)
    assert len(installs) == 3
    assert "--require-hashes --requirement locks/product.txt" in installs[0]
    assert "--require-hashes --requirement locks/build.txt" in installs[1]
    assert "--no-deps" in installs[2]
    # the wheel is made with what was locked, not with what pip fetches for it
    (wheel,) = re.findall(r"pip wheel (.*?)(?: \\)?$", text, re.MULTILINE)
    assert "--no-deps --no-build-isolation" in wheel
    (backend,) = asked(pyproject()["build-system"]["requires"])
    assert backend.specifier.contains(locked("build.txt")[backend.name])
    assert "!locks" in (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
