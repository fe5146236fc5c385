"""A DEM file and the command line as a person starts it."""

import json
import sys
from dataclasses import dataclass, replace

import numpy as np
import pytest
import rasterio
from rasterio.transform import Affine

import service.cli.app
from terrain import write_npz
from tests.service.cli.height_questions import MOON
from tests.service.small_maps import CELL_EAST_M, CELL_NORTH_M, NORTH_M, WEST_M, small_grid


@dataclass(frozen=True)
class Ended:
    code: int
    stdout: str
    stderr: str

    def told(self):
        """The JSON that was printed by a command in which nothing went wrong."""
        assert self.code == 0, self.stderr
        return json.loads(self.stdout)

    def refused(self, *words):
        """It was bad input, and one sentence with these words is all that was printed."""
        assert self.code == 2, self.stderr
        assert [word for word in words if word not in self.stderr] == [], self.stderr
        assert self.stderr.count("\n") == 1, self.stderr
        assert self.stderr.endswith((".\n", "?\n")), self.stderr
        assert "Traceback" not in self.stderr
        assert self.stdout == ""


@pytest.fixture
def sightline(capfd, monkeypatch):
    """Run a command line in this process, exactly as the console script does."""

    def run(*words):
        monkeypatch.setattr(sys, "argv", ["sightline", *map(str, words)])
        capfd.readouterr()
        with pytest.raises(SystemExit) as left:
            service.cli.app.main()
        said = capfd.readouterr()
        return Ended(left.value.code, said.out, said.err)

    return run


@pytest.fixture(scope="session")
def dem_file(tmp_path_factory):
    """The small ground as a GeoTIFF in UTM with declared nodata."""
    path = tmp_path_factory.mktemp("dem") / "small.tif"
    grid = small_grid()
    transform = Affine(CELL_EAST_M, 0.0, WEST_M - CELL_EAST_M / 2, 0.0, -CELL_NORTH_M, NORTH_M + CELL_NORTH_M / 2)
    with rasterio.open(
        path, "w", driver="GTiff", height=grid.rows, width=grid.cols, count=1, dtype="float32", nodata=-9999.0,
        crs="EPSG:32611", transform=transform,
    ) as dataset:  # fmt: skip
        dataset.write(np.where(np.isnan(grid.heights_m), np.float32(-9999.0), grid.heights_m), 1)
    return path


@pytest.fixture
def dem(tmp_path):
    """A function that writes the small ground with heights that count from somewhere, in a CRS."""

    def write(datum, crs="EPSG:32611"):
        path = tmp_path / "ground.npz"
        grid = replace(small_grid(crs), vertical_datum=datum)
        if crs == MOON:
            grid = replace(grid, origin_north_m=1.2e6)
        write_npz(grid, path)
        return path

    return write
