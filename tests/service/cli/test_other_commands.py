"""info, los, warm-up, help, version: and that none of them makes anybody wait."""

import json
import math
import re
import subprocess
import sys

import numpy as np
import pytest

from dem_samples import sample_path
from terrain import ElevationGrid, write_npz
from tests.service.small_maps import COLS, NORTH_M, ROWS, WALL_COLUMN, WEST_M


def test_info_tells_what_was_read(sightline, dem_file):
    ended = sightline("info", dem_file)
    assert (ended.code, ended.stderr) == (0, "")
    for words in ("small.tif", f"{ROWS} rows × {COLS} columns", "30 m east, 20 m north", "EPSG:32611", "9 (1.25 %)"):
        assert words in ended.stdout


def test_info_as_json_is_json_and_nothing_else(sightline, dem_file):
    described = json.loads(sightline("info", dem_file, "--json").stdout)
    assert (described["rows"], described["cols"], described["unknown_posts"]) == (ROWS, COLS, 9)
    assert described["heights_m"]["min"] == 0.0
    assert described["driver"] == "GTiff"
    assert len(described["sha256"]) == 64


def test_info_tells_each_conversion_and_warning(sightline, dem_file):
    described = json.loads(sightline("info", sample_path("jacksboro"), "--json").stdout)
    assert any("Warped from WGS 84" in sentence for sentence in described["conversions"])
    undeclared = json.loads(sightline("info", dem_file, "--nodata", "nan", "--json").stdout)
    assert any("-9999" in sentence.replace("−", "-") for sentence in undeclared["warnings"])
    assert "Warning:" in sightline("info", dem_file, "--nodata", "nan").stdout


def test_los_tells_the_verdict_and_the_wall_in_the_way(sightline, dem_file):
    west = f"{WEST_M + 95},{NORTH_M - 305},5agl"
    east = f"{WEST_M + 800},{NORTH_M - 305},5agl"
    blocked = json.loads(sightline("los", dem_file, "--from", west, "--to", east, "--json").stdout)
    assert blocked["verdict"] == "blocked"
    assert blocked["clearance_m"] < 0.0
    assert blocked["blocking_point_m"][0] == pytest.approx(WEST_M + 30.0 * WALL_COLUMN, abs=1.0)
    above = sightline("los", dem_file, "--from", west.replace("5agl", "90msl"), "--to", east.replace("5agl", "90msl"))
    assert "Line of sight: clear" in above.stdout


def test_los_adds_fresnel_and_probability_when_asked(sightline, dem_file):
    ends = ("--from", f"{WEST_M},{NORTH_M - 305},90msl", "--to", f"{WEST_M + 800},{NORTH_M - 305},90msl")
    plain = json.loads(sightline("los", dem_file, *ends, "--json").stdout)
    assert (plain["fresnel_clearance"], plain["probability_clear"]) == (None, None)
    asked = sightline("los", dem_file, *ends, "--wavelength", "0.1", "--dem-sigma", "4", "--json")
    full = json.loads(asked.stdout)
    assert full["fresnel_clearance"] > 0.0
    normal = 0.5 * (1.0 + math.erf(full["clearance_m"] / 4.0 / math.sqrt(2.0)))
    assert full["probability_clear"] == pytest.approx(normal, abs=1e-9)


def test_los_says_what_is_not_known_over_unknown_ground_and_below_the_ground(sightline, tmp_path):
    heights_m = np.zeros((9, 21), np.float32)
    heights_m[:, 15], heights_m[4:, 5] = np.nan, 40.0
    path = tmp_path / "dem.npz"
    write_npz(ElevationGrid(heights_m, 10.0, 10.0), path)

    def los(north_m, height):
        ends = ("--from", f"0,{north_m},{height}", "--to", f"200,{north_m},{height}")
        return sightline("los", path, *ends, "--wavelength", "0.1", "--dem-sigma", "2").stdout

    unknown, blocked, below = los(-20, "5agl"), los(-60, "5agl"), los(-20, "-9msl")
    assert ("Line of sight: unknown" in unknown, "Line of sight: blocked" in blocked) == (True, True)
    for words in (unknown, blocked):
        assert re.search(r"Fresnel clearance[ │]+not known ", words)
        assert re.search(r"diffraction loss[ │]+not known ", words)
        assert "The line passes over unknown ground, so what depends on the ground there is not known." in words
    assert re.search(r"probability clear[ │]+not known ", unknown)
    assert re.search(r"probability clear[ │]+0\.000 ", blocked)
    assert [re.search(r"\b(nan|inf)\b", words) for words in (unknown, blocked, below)] == [None] * 3


@pytest.mark.parametrize(("end", "sentence"), [("1,2", "--to '1,2' is not of the form"), ("nan,2,3msl", "--to: EAST:")])
def test_los_refuses_bad_ends(sightline, dem_file, end, sentence):
    ended = sightline("los", dem_file, "--from", f"{WEST_M},{NORTH_M},90msl", "--to", end)
    assert ended.code == 2
    assert sentence in ended.stderr


def test_warm_up_is_silent(sightline):
    ended = sightline("warm-up")
    assert (ended.code, ended.stdout, ended.stderr) == (0, "", "")


@pytest.mark.parametrize("command", ["info", "visibility", "los", "serve", "demo", "warm-up"])
def test_every_command_has_help(sightline, command):
    ended = sightline(command, "--help")
    assert (ended.code, ended.stderr) == (0, "")
    assert "Usage: sightline" in ended.stdout


def test_the_version_is_that_of_the_distribution(sightline):
    assert sightline("--version").stdout.startswith("sightline 0.")


def test_help_loads_none_of_the_heavy_libraries():
    heavy = ["numba", "numpy", "rasterio", "pyproj", "matplotlib", "scipy", "pydantic", "fastapi", "trimesh", "httpx"]
    program = (
        "import sys\nsys.argv = ['sightline', '--help']\nfrom service.cli import main\n"
        f"try:\n    main()\nfinally:\n    print(sorted(set({heavy}) & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    assert done.stderr.strip() == "[]"


@pytest.mark.parametrize("line", ["visibility DEM --anchor bad", "place DEM", "dop DEM --anchor bad", "morph DEM"])
def test_a_wrong_option_is_told_before_what_calculates_and_draws_is_loaded(line):
    heavy = [
        "matplotlib",
        "scipy.ndimage",
        "scipy.stats",
        "fastapi",
        "trimesh",
        "httpx",
        "ompl",
        "dask",
        "service.products.registry",
    ]
    program = (
        f"import sys\nsys.argv = ['sightline', *{line.split()}]\nfrom service.cli import main\n"
        f"try:\n    main()\nfinally:\n    print(sorted(set({heavy}) & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stdout.strip() == "[]"


def test_a_reader_that_leaves_early_is_no_accident(dem_file):
    line = f"{sys.executable} -m service.cli info {dem_file} --json | head -c 1"
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "{"
    assert done.stderr == ""
