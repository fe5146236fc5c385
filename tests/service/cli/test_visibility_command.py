"""``sightline visibility`` writes what the packages calculate, and says it to people and to programs."""

import json

import numpy as np
import pytest
import rasterio

from terrain import height_at, read_dem, to_lon_lat
from tests.service.small_maps import NORTH_M, WEST_M
from visibility import FLAT, Anchor, AntennaLimits, min_visible_altitude

FILES = {"visibility.json", "visible.tif", "min_visible_altitude.tif", "count.tif", "map.png", "map.kml"}
D1 = f"D1,{WEST_M + 95},{NORTH_M - 305},12agl"
D2 = f"D2,{WEST_M + 750},{NORTH_M - 200},90msl"


@pytest.fixture
def expected(dem_file):
    """The direct answer to D1 and D2."""
    grid = read_dem(dem_file)
    ground_m = float(height_at(grid, WEST_M + 95.0, NORTH_M - 305.0))
    anchors = [
        Anchor("D1", WEST_M + 95.0, NORTH_M - 305.0, ground_m + 12.0),
        Anchor("D2", WEST_M + 750.0, NORTH_M - 200.0, 90.0),
    ]

    def answer(mode="fast", curvature=None, unknown="unknown"):
        return min_visible_altitude(grid, anchors, mode, curvature, unknown=unknown)

    return answer


def read(path):
    with rasterio.open(path) as dataset:
        return dataset.read()


@pytest.mark.parametrize("mode", ["fast", "exact"])
def test_the_files_hold_the_direct_answer(sightline, dem_file, tmp_path, expected, mode):
    ended = sightline(
        "visibility", dem_file, "--anchor", D1, "--anchor", D2, "--receiver-height", 2, "--mode", mode,
        "--out", tmp_path,
    )  # fmt: skip
    assert (ended.code, ended.stderr) == (0, "")
    assert {path.name for path in tmp_path.iterdir()} == FILES
    answer = expected(mode)
    np.testing.assert_array_equal(read(tmp_path / "min_visible_altitude.tif"), answer.altitude_m)
    visible = answer.visible(above_ground_m=2.0)
    np.testing.assert_array_equal(read(tmp_path / "visible.tif"), visible)
    count = read(tmp_path / "count.tif")[0]
    known = ~(visible == 255).all(axis=0)
    np.testing.assert_array_equal(count[known], (visible == 1).sum(axis=0)[known])


def test_options_reach_the_calculation(sightline, dem_file, tmp_path, expected):
    ended = sightline(
        "visibility", dem_file, "--anchor", D1, "--anchor", D2, "--receiver-altitude", 80, "--curvature", "flat",
        "--unknown", "blocked", "--out", tmp_path,
    )  # fmt: skip
    assert ended.code == 0
    visible = expected("fast", FLAT, "blocked").visible(altitude_m=80.0)
    np.testing.assert_array_equal(read(tmp_path / "visible.tif"), visible)
    summary = json.loads((tmp_path / "visibility.json").read_text())
    assert summary["curvature"] == "flat: no curvature"
    assert summary["receiver"] == {"above_ground_m": None, "altitude_m": 80.0}


def test_the_table_tells_each_anchors_share(sightline, dem_file):
    ended = sightline("visibility", dem_file, "--anchor", D1, "--anchor", D2)
    assert ended.code == 0
    for word in ("D1", "D2", "visible", "hidden", "unknown", "small.tif", "receiver 1.5 m above ground", "mode fast"):
        assert word in ended.stdout
    assert "…" not in ended.stdout, "nothing is cut off"


def test_without_a_folder_only_the_summary_is_printed(sightline, dem_file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ended = sightline("visibility", dem_file, "--anchor", D1, "--json")
    assert json.loads(ended.stdout)["files"] == []
    assert list(tmp_path.iterdir()) == []


def test_longitude_and_latitude_mean_the_same_place(sightline, dem_file):
    lon_deg, lat_deg = to_lon_lat(read_dem(dem_file), WEST_M + 95.0, NORTH_M - 305.0)
    by_degrees = sightline("visibility", dem_file, "--lonlat", "--anchor", f"D1,{lon_deg},{lat_deg},12agl", "--json")
    by_metres = sightline("visibility", dem_file, "--anchor", D1, "--json")
    shares = [json.loads(ended.stdout)["count_histogram"] for ended in (by_degrees, by_metres)]
    assert shares[0] == shares[1]


def test_limits_come_from_a_file(sightline, dem_file, tmp_path):
    anchors = tmp_path / "anchors.json"
    place = {"east_m": WEST_M + 95.0, "north_m": NORTH_M - 305.0}
    anchors.write_text(json.dumps([{"id": "near", **place, "altitude_m": 60.0, "max_range_m": 150.0}]))
    ended = sightline("visibility", dem_file, "--anchors", anchors, "--out", tmp_path / "out")
    assert ended.code == 0
    direct = min_visible_altitude(
        read_dem(dem_file), [Anchor("near", *place.values(), 60.0, limits=AntennaLimits(max_range_m=150.0))]
    )
    np.testing.assert_array_equal(read(tmp_path / "out/visible.tif"), direct.visible(above_ground_m=1.5))


def test_anchors_of_options_and_files_are_taken_together(sightline, dem_file, tmp_path):
    anchors = tmp_path / "more.csv"
    anchors.write_text(f"id,east_m,north_m,altitude_m\nD3,{WEST_M},{NORTH_M},200\n")
    ended = sightline("visibility", dem_file, "--anchor", D1, "--anchors", anchors, "--json")
    assert [anchor["id"] for anchor in json.loads(ended.stdout)["anchors"]] == ["D1", "D3"]


def test_nodata_of_the_option_wins(sightline, dem_file):
    described = json.loads(sightline("info", dem_file, "--nodata", 0, "--json").stdout)
    assert described["unknown_posts"] != 9
    mapped = json.loads(sightline("visibility", dem_file, "--anchor", D2, "--nodata", -9999, "--json").stdout)
    assert mapped["dem"]["unknown_posts"] == 9


def test_warnings_stand_below_the_table(sightline, dem_file):
    ended = sightline("visibility", dem_file, "--anchor", f"far,{WEST_M - 2000},{NORTH_M},300msl")
    assert "Warning: Anchor far is 2000 m outside the DEM" in ended.stdout


def test_a_map_of_what_is_usable_says_so_and_not_what_rays_err_by(sightline, dem_file, tmp_path):
    heard = ("--sight", "usable", "--radio", "868MHz")
    ended = sightline("visibility", dem_file, "--anchor", D1, "--receiver-height", 2, *heard, "--out", tmp_path)
    assert ended.code == 0, ended.stderr
    said = " ".join(ended.stdout.split())
    assert "Anchors usable" in said
    assert "Signals over every edge of the triangulated surface" in said
    assert "in sight" not in said
    assert "--mode exact" not in said
