"""Every option of reading a DEM that a warning recommends exists, on every command that reads one."""

import json

import numpy as np
import pytest
import rasterio

from service.cli.app import COMMANDS, command_line
from tests.terrain.files import hill, write_tif

NEW_MEXICO = rasterio.Affine(100, 0, 1_650_000, 0, -100, 1_480_000)
READING = {"--nodata", "--crs", "--height-unit", "--band", "--cell-m"}


def test_every_command_that_reads_a_dem_has_all_options_of_reading():
    app = command_line()
    options = {
        name: {word for argument in app[name].assemble_argument_collection() for word in argument.names}
        for name in COMMANDS
        if app[name].default_command is not None  # else it is a group of commands
    }
    readers = {name for name, words in options.items() if "DEM" in words}
    assert {"info", "visibility", "dop", "morph", "bubble", "plan", "place", "fly", "reposition", "los"} <= readers
    for name in readers:
        assert options[name] >= READING, name


def heights(sightline, *words):
    ended = sightline("info", *words, "--json")
    assert ended.code == 0, ended.stderr
    return json.loads(ended.stdout)["heights_m"]["max"]


@pytest.mark.parametrize("options", [("--height-unit", "us-ft"), ("--crs", "EPSG:6529+6360")])
def test_heights_in_feet_can_be_told(sightline, tmp_path, options):
    path = write_tif(tmp_path / "dem.tif", hill(), crs="EPSG:6529", transform=NEW_MEXICO)
    assert heights(sightline, path) == pytest.approx(float(hill().max()))
    assert heights(sightline, path, *options) == pytest.approx(float(hill().max()) * 1200 / 3937, rel=1e-6)


def test_the_unit_reaches_the_calculation(sightline, tmp_path):
    path = write_tif(tmp_path / "dem.tif", hill() * 100)
    ends = ("--from", "500025,4999975,2agl", "--to", "500125,4999975,2agl")
    told = json.loads(sightline("los", path, *ends, "--height-unit", "cm", "--json").stdout)
    assert told["from_m"][2] == pytest.approx(float(hill()[2, 2]) + 2.0, abs=0.1)


def test_band_and_cell_size_can_be_given(sightline, tmp_path):
    path = write_tif(tmp_path / "dem.tif", np.stack([hill() * 0, hill()]), crs=None, transform=None)
    assert "give --cell-m" in sightline("info", path).stderr
    assert heights(sightline, path, "--cell-m", "5", "--band", "2") == pytest.approx(float(hill().max()))
    assert "there is no band 7" in sightline("info", path, "--cell-m", "5", "--band", "7").stderr


def test_a_crs_that_names_a_file_ends_with_a_sentence(sightline, dem_file):
    ended = sightline("info", dem_file, "--crs", "+init=/etc/passwd:root")
    assert (ended.code, ended.stdout) == (2, "")
    assert "may make PROJ open a file" in ended.stderr
