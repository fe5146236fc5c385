"""sightline place: files that hold what the library answers, and every wrong line told in a sentence."""

import csv
import json
import math
import os
import signal
import subprocess
import sys
import time
from functools import partial

import numpy as np
import pytest
import rasterio

from planning.placement import Cluster, Goal, area_targets, candidate_grid, place_anchors
from service.cli.asking.anchor_files import anchors_from_file
from service.parts.anchors import AnchorIn
from terrain import read_dem
from tests.service.small_maps import CELL_EAST_M, CELL_NORTH_M, NORTH_M, WEST_M

EAST_M, SOUTH_M = WEST_M + 29 * CELL_EAST_M, NORTH_M - 23 * CELL_NORTH_M
LATTICE = ("--spacing", 150, "--height", "40agl", "--objective", "coverage", "--min-anchors", 2)
LOCAL = {"coordinates_are": "metres east and north in the DEM's local frame, which has no CRS"}


def geojson(path, geometry, **properties):
    feature = {"type": "Feature", "geometry": geometry, "properties": properties}
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature], **LOCAL}))
    return path


def box(west_m, south_m, east_m, north_m):
    ring = [[west_m, south_m], [east_m, south_m], [east_m, north_m], [west_m, north_m], [west_m, south_m]]
    return {"type": "Polygon", "coordinates": [ring]}


@pytest.fixture
def line(tmp_path):
    return geojson(
        tmp_path / "line.geojson",
        {"type": "LineString", "coordinates": [[WEST_M + 60.0, NORTH_M - 60.0], [EAST_M - 60.0, SOUTH_M + 60.0]]},
    )


def test_the_command_answers_what_the_library_answers(sightline, dem_file, tmp_path):
    done = sightline("place", dem_file, "--count", 3, *LATTICE, "--out", tmp_path / "out", "--json")
    assert (done.code, done.stderr) == (0, "")
    told = json.loads(done.stdout)
    grid = read_dem(str(dem_file))
    expected = place_anchors(
        grid, candidate_grid(grid, 150.0, above_ground_m=[40.0]), area_targets(grid), 3, Goal("coverage", min_anchors=2)
    )
    assert told["value_share"] == expected.value
    assert [(p["east_m"], p["north_m"]) for p in told["placed"]] == [(a.east_m, a.north_m) for a in expected.anchors]
    with rasterio.open(tmp_path / "out" / "count.tif") as dataset:
        after = dataset.read(2)
    assert np.mean(after[after != 255] >= 2) == pytest.approx(expected.value)
    files = "place.json anchors.geojson anchors.csv anchors.kml plans.zip count.tif dop.tif map.png before.png dop.png"
    assert {path.name for path in (tmp_path / "out").iterdir()} == {*files.split(), "dop_before.png"}
    assert set(told["files"]) == {str(tmp_path / "out" / path.name) for path in (tmp_path / "out").iterdir()}


def test_the_placed_anchors_are_the_next_command_s_anchors(sightline, dem_file, tmp_path):
    sightline("place", dem_file, "--count", 3, *LATTICE, "--max-range", 900, "--out", tmp_path)
    with (tmp_path / "anchors.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [AnchorIn.model_validate({k: v if k == "id" else float(v) for k, v in row.items()}).id for row in rows] == [
        "P1", "P2", "P3",
    ]  # fmt: skip
    for name in ("anchors.csv", "anchors.geojson"):
        seen = sightline("visibility", dem_file, "--anchors", tmp_path / name, "--json")
        assert seen.code == 0, seen.stderr
        assert [anchor["id"] for anchor in json.loads(seen.stdout)["anchors"]] == ["P1", "P2", "P3"]


def test_the_dilution_is_told_and_a_row_of_anchors_is_warned_of(sightline, dem_file, tmp_path):
    row = [[WEST_M + 60.0 + 40.0 * n, SOUTH_M + 60.0] for n in range(4)]
    masts = geojson(tmp_path / "masts.geojson", {"type": "MultiPoint", "coordinates": row})
    line = ("place", dem_file, "--count", 4, "--mast", f"{masts},400msl", "--objective", "coverage")
    told = json.loads(sightline(*line, "--json").stdout)
    assert told["dilution"] == {
        "measure": "pdop", "median": None, "within_limit_share": 0.0, "no_fix_share": 1.0, "useless_share": 1.0,
    }  # fmt: skip
    assert any("stand in a row" in warning and "--objective dop" in warning for warning in told["warnings"])
    printed = sightline(*line)
    assert "PDOP, median" in printed.stdout
    assert "stand in a row" in printed.stdout + printed.stderr


def test_anchors_keep_their_longest_range_and_error_in_either_file(sightline, dem_file, tmp_path):
    done = sightline("place", dem_file, "--count", 3, *LATTICE, "--max-range", 900, "--out", tmp_path)
    assert done.code == 0, done.stderr
    for name in ("anchors.csv", "anchors.geojson"):
        anchors = anchors_from_file(tmp_path / name)
        assert [(anchor.max_range_m, anchor.ranging_sigma_m) for anchor in anchors] == [(900.0, 0.1)] * 3


def test_the_beacons_parameters_name_the_origin_and_each_beacon(sightline, dem_file, tmp_path):
    done = sightline(
        "place", dem_file, "--count", 2, *LATTICE, "--vertical-datum", "EGM96", "--out", tmp_path, "--json"
    )
    first, second = json.loads(done.stdout)["placed"]
    lines = (tmp_path / "beacons.parm").read_text().splitlines()
    settings = dict(line.split(",") for line in lines if not line.startswith("#"))
    assert set(settings) == {"BCN_LATITUDE", "BCN_LONGITUDE", "BCN_ALT", "BCN_ORIENT_YAW"}
    assert float(settings["BCN_ALT"]) == pytest.approx(first["altitude_m"] - first["above_ground_m"], abs=0.01)
    offsets = [[float(v) for v in line.split(": ")[1].split(", ")] for line in lines if line.startswith("# beacon")]
    assert offsets[0] == pytest.approx([0.0, 0.0, -first["above_ground_m"]], abs=0.01)
    # turned from grid north to true north, 0.6° here, and over ground: the map's scale is 0.9997
    way_m = math.hypot(second["north_m"] - first["north_m"], second["east_m"] - first["east_m"])
    assert math.hypot(*offsets[1][:2]) == pytest.approx(way_m / 0.9997, abs=0.02)


def test_ground_that_counts_nothing_is_not_served(sightline, dem_file, tmp_path, line):
    west = geojson(tmp_path / "west.geojson", box(WEST_M - 9, SOUTH_M - 9, WEST_M + 540.0, NORTH_M + 9), weight=0.0)
    plain, weighted = (
        json.loads(sightline("place", dem_file, "--count", 1, *LATTICE, "--min-anchors", 1, *words, "--json").stdout)
        for words in ((), ("--weights", west))
    )
    assert weighted["targets"]["points"] < plain["targets"]["points"]
    assert weighted["placed"][0]["east_m"] > WEST_M + 540.0  # behind the wall, where alone it counts
    corridor = sightline(
        "place", dem_file, "--count", 2, *LATTICE, "--path", line, "--corridor", 90, "--weights", west, "--json"
    )
    assert json.loads(corridor.stdout)["targets"]["what"] == "corridor"


def test_a_path_and_the_fewest_anchors_that_serve_it(sightline, dem_file, line):
    done = sightline("place", dem_file, "--reach", 0.9, *LATTICE, "--path", line)
    assert done.code == 0, done.stderr
    assert "path within limits" in done.stdout
    assert "anchors needed at least" in done.stdout


def test_a_cluster_that_nobody_answers_for_is_refused_or_done_without(sightline, dem_file, monkeypatch):
    monkeypatch.setattr("service.products.placements.calculate.Cluster", partial(Cluster, timeout_s=0.5))
    words = ("place", dem_file, "--count", 2, *LATTICE, "--scheduler", "tcp://127.0.0.1:9")
    refused = sightline(*words)
    assert refused.code == 2
    assert "No Dask scheduler answers" in refused.stderr
    done = sightline(*words, "--or-local", "--json")
    assert done.code == 0, done.stderr
    assert any("on this machine instead" in warning for warning in json.loads(done.stdout)["warnings"])


def test_ctrl_c_ends_the_search_with_the_best_so_far(dem_file, tmp_path):
    words = ("place", dem_file, "--count", 8, "--spacing", 6, "--height", "40agl", "--objective", "dop", "--spare", 1)
    process = subprocess.Popen(
        [sys.executable, "-m", "service.cli", *map(str, words), "--json"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, "NUMBA_NUM_THREADS": "1"},
    )  # fmt: skip
    # until it is at it: the handler is there before the first parcel
    deadline_s = time.monotonic() + 60.0
    while process.poll() is None and _seconds_of_work(process.pid) < 3.0:
        assert time.monotonic() < deadline_s
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err.decode()
    told = json.loads(out)
    assert told["stopped"]
    assert 1 <= len(told["placed"]) <= 8


def _seconds_of_work(pid):
    import psutil

    return psutil.Process(pid).cpu_times().user


BAD = {
    "no candidates": ((), "No candidates: give --spacing or --best-sites"),
    "a lattice without height": (("--spacing", 100), "--spacing needs at least one --height"),
    "a height of nothing": (("--spacing", 100, "--height", "40"), "is not of the form 120agl"),
    "a height without lattice": (("--height", "40agl"), "--height and --where need --spacing or --best-sites"),
    "a mast without height": (("--mast", "masts.geojson"), "is not of the form FILE,HEIGHT"),
    "a link without base": ((*LATTICE, "--relays", 1), "need --base"),
    "a base of nothing": ((*LATTICE, "--base", "1,2"), "--base '1,2' is not of the form"),
    "count and reach": ((*LATTICE, "--reach", 0.5), "exactly one of count and reach"),
    "more in sight than there are": ((*LATTICE, "--min-anchors", 5), "5 anchors in sight are asked for, and there are"),
    "contradictory rules": ((*LATTICE, "--min-agl", 90, "--max-agl", 30), "The rules contradict each other"),
    "no candidate left": ((*LATTICE, "--max-altitude", -50), "above the ceiling"),
    "a spacing of nothing": (("--spacing", 0, "--height", "40agl"), "greater than 0"),
    "a file that is not there": ((*LATTICE, "--no-fly", "nowhere.geojson"), "cannot be read"),
    "local without scheduler": ((*LATTICE, "--or-local"), "--or-local goes with --scheduler"),
    "a corridor without path": ((*LATTICE, "--corridor", 50), "--corridor needs a path"),
}


@pytest.mark.parametrize("what", BAD)
def test_a_wrong_line_is_told_in_one_sentence(sightline, dem_file, what):
    words, sentence = BAD[what]
    ended = sightline("place", dem_file, "--count", 2, *words)
    ended.refused(sentence)


BAD_FILES = {
    "no JSON": ("--serve", "what", "is not JSON"),
    "no geometry": ("--serve", "{}", "holds no GeoJSON geometries"),
    "a list": ("--serve", "[1]", "is not GeoJSON"),
    "points for an area": ("--serve", {"type": "Point", "coordinates": [0, 0]}, "holds no polygons"),
    "a polygon for a path": ("--path", box(0, 0, 1, 1), "holds no LineString"),
    "words for numbers": ("--path", {"type": "LineString", "coordinates": [["a", "b"]]}, "coordinates are no numbers"),
    "a polygon of nothing": ("--serve", {"type": "Polygon", "coordinates": []}, "without a ring"),
    "an area outside": ("--serve", box(0, 0, 1, 1), "no post of the DEM"),
    "a path outside": ("--path", {"type": "LineString", "coordinates": [[0, 0], [9, 9]]}, "no known ground on the DEM"),
    "a bow tie": ("--no-fly", {"type": "Polygon", "coordinates": [[[0, 0], [1, 1], [1, 0], [0, 1]]]}, "is no polygon"),
    "weights without weight": ("--weights", box(0, 0, 1, 1), "without the property weight"),
}


@pytest.mark.parametrize("what", BAD_FILES)
def test_a_wrong_file_is_told_in_one_sentence(sightline, dem_file, tmp_path, what):
    option, content, sentence = BAD_FILES[what]
    path = tmp_path / "shape.geojson"
    if isinstance(content, str):
        path.write_text(content)
    else:
        geojson(path, content)
    ended = sightline("place", dem_file, "--count", 2, *LATTICE, option, path)
    ended.refused(sentence)


def test_a_request_in_a_file_is_taken_as_over_http(sightline, dem_file, tmp_path):
    path = tmp_path / "request.json"
    body = {"count": 4, "candidates": [{"spacing_m": 150.0, "above_ground_m": [40.0]}]}
    path.write_text(json.dumps({"dem_id": "d1", **body, "goal": {"visible": 3}}))
    done = sightline("place", dem_file, "--request", path, "--json")
    assert done.code == 0, done.stderr
    assert json.loads(done.stdout)["parameters"]["goal"]["min_anchors"] == 3
    assert "dem_id of a service; it is passed over" in done.stderr
    assert "visible is called min_anchors now" in done.stderr
    path.write_text('{"count": "many"}')
    ended = sightline("place", dem_file, "--request", path)
    assert (ended.code, "The request request.json:" in ended.stderr) == (2, True)
    assert sightline("place", dem_file, "--request", tmp_path / "none.json").code == 2


def test_the_posts_that_see_most_may_be_the_candidates(sightline, dem_file):
    words = ("place", dem_file, "--count", 2, "--best-sites", 6, "--height", "40agl")
    told = sightline(*words, "--json").told()
    assert 2 <= told["candidates"]["left"] <= 6
    assert [round(one["above_ground_m"], 3) for one in told["placed"]] == [40.0, 40.0]
    sightline(*words[:-1], "400msl").refused("not at an altitude: give its height above ground (80agl).")
    sightline(*words[:6]).refused("--best-sites needs at least one --height, such as 120agl.")


def test_who_names_no_objective_asks_where_a_rover_on_the_ground_is(sightline, dem_file):
    words = ("place", dem_file, "--count", 3, "--spacing", 150, "--height", "40agl", "--json")
    told = sightline(*words).told()
    assert told["objective"] == "mean_error"
    assert told["goal"].startswith("mean position error along the surface of ranging with a sigma of 0.1 m, metres")
    said = sightline(*words, "--objective", "mean-error", "--surface").told()
    assert [told[name] for name in ("placed", "value_m", "bound_m")] == [
        said[name] for name in ("placed", "value_m", "bound_m")
    ]
    assert "and at least 3 in sight" in sightline(*words, "--min-anchors", 3).told()["goal"]
    assert sightline(*words[:2], "--reach", 0.2, *words[4:]).told()["objective"] == "coverage"
    sightline(*words, "--measure", "hdop").refused("hdop goes with an objective")


def test_a_rover_on_the_ground_asks_for_one_anchor_less(sightline, dem_file):
    dilution = ("place", dem_file, "--spacing", 150, "--height", "40agl", "--objective", "dop", "--dop-limit", 20)
    bound = sightline(*dilution, "--surface", "--count", 2, "--json")
    assert bound.code == 0, bound.stderr
    assert json.loads(bound.stdout)["goal"].startswith("share with at least 2 in sight and PDOP along the surface")
    in_space = sightline(*dilution, "--count", 2)
    in_space.refused("A fix needs 3 anchors in sight, and there are only 2; the objective coverage counts")
    asked = sightline(*dilution, "--surface", "--min-anchors", 3, "--count", 2)
    assert (asked.code, asked.stderr) == (2, "3 anchors in sight are asked for, and there are only 2.\n")
