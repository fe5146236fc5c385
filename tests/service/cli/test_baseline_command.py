"""``sightline baseline``: centimetres beside a base, files, and what it refuses."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from gnss.sky import ecef_to_enu_m
from terrain import ElevationGrid, write_npz
from tests.gnss.differential import world


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Rover on a half circle, base, orbits; made up and exact."""
    folder = tmp_path_factory.mktemp("pair")
    rng = np.random.default_rng(3)
    for name, places_m in (("rover", world.circle_m(20)), ("base", [world.base_m()] * 20)):
        (folder / f"{name}.obs").write_text(world.observation_text(world.heard(places_m, rng), world.base_m()))
    (folder / "made.nav").write_text(world.navigation_text())
    return folder


def words(folder, *more):
    return ("baseline", folder / "rover.obs", "--base", folder / "base.obs", "--orbits", folder / "made.nav", *more)


def test_it_writes_where_the_rover_was(files, tmp_path, sightline):
    ended = sightline(*words(files, "--out", tmp_path / "out", "--base-at=8.5,47,500"))
    assert ended.code == 0, ended.stderr
    with (tmp_path / "out" / "baseline.csv").open() as file:
        rows = list(csv.DictReader(file))
    truth_m = ecef_to_enu_m(world.PLACE, world.circle_m(20))
    fixed = [n for n, row in enumerate(rows) if row["fix"] == "fixed"]
    assert len(rows) == 20
    assert len(fixed) > 5
    for n in fixed:
        found_m = [float(rows[n][name]) for name in ("east_m", "north_m", "up_m")]
        assert found_m == pytest.approx(truth_m[n], abs=0.05)
    collection = json.loads((tmp_path / "out" / "baseline.geojson").read_text())
    assert len(collection["features"]) == sum(row["fix"] != "none" for row in rows)
    lon_deg, lat_deg, height_m = collection["features"][0]["geometry"]["coordinates"]
    assert (lon_deg, lat_deg) == pytest.approx((8.5, 47.0), abs=0.001)
    assert height_m == pytest.approx(500.0, abs=5.0)


def test_the_summary_is_json_and_says_that_a_header_is_no_survey(files, sightline):
    ended = sightline(*words(files, "--json"))
    told = json.loads(ended.stdout)
    assert told["epochs"] == 20
    assert told["left_out"] is None
    assert "header" in told["warnings"][0]


def test_what_the_ground_hides_is_left_out(files, tmp_path, sightline):
    heights = np.zeros((61, 61))
    heights[:20] = 2000.0  # a wall in the north
    grid = ElevationGrid(heights, 50.0, 50.0, 462_000.0 - 1500.0, 5_205_300.0 + 1500.0, "EPSG:32632")
    write_npz(grid, tmp_path / "wall.npz")
    ended = sightline(*words(files, "--dem", tmp_path / "wall.npz", "--json"))
    assert ended.code == 0, ended.stderr
    assert json.loads(ended.stdout)["left_out"] > 0


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        (("--base-at=8.5,47",), "LON,LAT,HEIGHT"),
        (("--base-at=8.5,97,0",), "LAT in"),
        (("--frequencies", "3"), "frequencies"),
        (("--mask", "95"), "elevation_mask_rad"),
        (("--cell-m", "5"), "go with --dem"),
    ],
)
def test_options_that_mean_nothing_are_refused(files, sightline, more, sentence):
    sightline(*words(files, *more)).refused(sentence)


def test_files_that_are_missing_or_exchanged_are_refused(files, sightline):
    sightline("baseline", files / "rover.obs").refused("--base and --orbits")
    sightline("baseline", files / "made.nav", "--base", files / "base.obs", "--orbits", files / "made.nav").refused(
        "another kind"
    )
    sightline("baseline", files / "none.obs", "--base", files / "base.obs", "--orbits", files / "made.nav").refused(
        "There is no"
    )
