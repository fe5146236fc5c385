"""A rover that detects and navigates needs no map: neither package loads a library of maps, meshes or rasters."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.house.repository import ROOT

OF_MAPS = ("rasterio", "pyproj", "scipy.spatial", "trimesh", "shapely", "terrain", "visibility")


@pytest.mark.parametrize("package", ["detection", "navigation", "gnss"])
def test_what_runs_on_a_rover_loads_no_library_of_maps(package: str) -> None:
    program = f"import sys, {package}\nprint([name for name in {OF_MAPS!r} if name in sys.modules])"
    run = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
