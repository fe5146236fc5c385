"""The paper's case says what its page says: good and bad geometry, and a flight that loses satellites."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import rasterio

from benchmarks.visibility.paper import write_case
from benchmarks.visibility.paper_case import (
    ALMANAC_FILE,
    BAD,
    COLS,
    DEM_FILE,
    FIRST_COL,
    FIRST_ROW,
    GOOD,
    LIMIT,
    ROWS,
    Scene,
    mountain_almanac,
    open_sky_pdop,
    read_mountains,
    scene,
    sections,
)
from benchmarks.visibility.paper_flight import ABOVE_GROUND_M, TAKE_OFF, fly, valley_path

pytestmark = pytest.mark.skipif(
    not (DEM_FILE.is_file() and ALMANAC_FILE.is_file()), reason="the real DEM and almanac are not beside the checkout"
)


@pytest.fixture(scope="module")
def scenes() -> tuple[Scene, Scene]:
    whole, almanac = read_mountains(), mountain_almanac()
    return scene(whole, almanac, GOOD), scene(whole, almanac, BAD)


def test_twelve_satellites_stand_well_at_one_time_and_badly_at_the_other(scenes: tuple[Scene, Scene]) -> None:
    good, bad = scenes
    assert len(good.surfaces.anchors) == len(bad.surfaces.anchors) == 12
    assert open_sky_pdop(good) == pytest.approx(1.21, abs=0.005)
    assert open_sky_pdop(bad) == pytest.approx(2.28, abs=0.005)


def test_bad_geometry_closes_the_air_near_most_of_the_ground(scenes: tuple[Scene, Scene]) -> None:
    good, bad = (shown.morphing.above_ground_m for shown in scenes)
    assert np.mean(good > 0.0) == pytest.approx(0.29, abs=0.01)
    assert np.mean(bad > 0.0) == pytest.approx(0.91, abs=0.01)
    assert np.nanmax(good) == pytest.approx(315.0, abs=5.0)
    assert np.nanmax(bad) == pytest.approx(662.0, abs=5.0)


def test_the_morphing_map_lies_between_the_layers_of_the_section_where_the_limit_is_passed(
    scenes: tuple[Scene, Scene],
) -> None:
    good, _ = scenes
    cut, _ = sections(good)
    grid = good.grid
    row = np.rint((grid.origin_north_m - cut.north_m) / grid.cell_north_m).astype(int)
    col = np.rint((cut.east_m - grid.origin_east_m) / grid.cell_east_m).astype(int)
    floor_m = good.morphing.altitude_m[row, col]
    # air over the post whose column it is, and over the surface beside it
    air = ~cut.below_ground & (cut.altitude_m >= grid.heights_m[row, col])
    above, below = air & (cut.altitude_m > floor_m + 0.05), air & (cut.altitude_m < floor_m - 0.05)
    assert (cut.dop[above] < LIMIT.dop_limit).all()
    single = good.morphing.no_flight_intervals[row, col] == 1
    assert (cut.dop[:, single][below[:, single]] >= LIMIT.dop_limit).all()
    assert below[:, single].sum() > 100


def test_a_flight_up_the_valley_keeps_its_height_and_loses_satellites() -> None:
    flown = fly(read_mountains(), mountain_almanac(), TAKE_OFF)
    assert (flown.points_m[:, 2] - flown.ground_m >= ABOVE_GROUND_M - 1e-6).all()
    assert (flown.visible <= flown.total).all()
    assert (flown.visible.min(), flown.total.max()) == (8, 12)
    assert (flown.pdop >= flown.pdop_total - 1e-9).all(), "fewer satellites never fix better"
    assert np.mean(flown.pdop >= LIMIT.dop_limit) == pytest.approx(0.47, abs=0.02)


def test_the_way_stays_on_the_floor_of_the_valley(scenes: tuple[Scene, Scene]) -> None:
    grid = scenes[0].grid
    points_m = valley_path(grid)
    step_m = np.hypot(*np.diff(points_m[:, :2], axis=0).T)
    assert step_m.max() <= 2.001, "20 m/s at 10 Hz"
    assert points_m[:, 2].max() < np.median(grid.heights_m), "the floor, not the slopes"


def test_the_pictures_of_the_page_are_those_that_the_command_writes_and_small(tmp_path: Path) -> None:
    paths, sentences = write_case(DEM_FILE, ALMANAC_FILE, tmp_path)
    page = (Path(__file__).parents[2] / "docs" / "paper-case.md").read_text(encoding="utf-8")
    for path in paths:
        assert f"images/paper/{path.name}" in page
        assert path.stat().st_size < 200_000
    assert len(sentences) == 3


def commands_of_the_page() -> list[str]:
    page = (Path(__file__).parents[2] / "docs" / "paper-case.md").read_text()
    return [line for line in page.splitlines() if line.startswith("sightline ")]


def test_the_commands_of_the_page_make_its_files(tmp_path: Path, scenes: tuple[Scene, Scene]) -> None:
    (tmp_path / "canyon.tif").symlink_to(DEM_FILE.resolve())
    (tmp_path / "almanac.yuma").symlink_to(ALMANAC_FILE.resolve())
    way_m = valley_path(scenes[0].grid)[::50]
    lines = (f"{east_m},{north_m},{ABOVE_GROUND_M}\n" for east_m, north_m in way_m[:, :2])
    (tmp_path / "flight.csv").write_text("east_m,north_m,above_ground_m\n" + "".join(lines))
    # the volume is written to 40 MB, and six hours are 25 maps: shorter here
    shorter = {
        "--layer 12 --bounds 381728,3792212,391719,3805203 --volume": "--layer 300 --volume",
        "0,21600,900": "0,900,900",
    }
    for command in commands_of_the_page():
        for long, short in shorter.items():
            command = command.replace(long, short)
        run = subprocess.run(
            [sys.executable, "-m", "service.cli", *command.split()[1:]],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
            capture_output=True,
            text=True,
        )
        assert run.returncode == 0, f"{command}\n{run.stderr}"
    for name in ("good/cut-1.png", "good/cut-2.png", "volume/volume.nc", "flight/path.csv", "day/animation.gif"):
        assert (tmp_path / name).stat().st_size > 10_000, name
    for folder, shown in zip(("good-morph", "bad-morph"), scenes, strict=True):
        with rasterio.open(tmp_path / folder / "above_ground.tif") as dataset:
            window = dataset.read(1)[FIRST_ROW : FIRST_ROW + ROWS, FIRST_COL : FIRST_COL + COLS]
        assert np.mean(window > 0.0) == pytest.approx(np.mean(shown.morphing.above_ground_m > 0.0), abs=1e-3)
