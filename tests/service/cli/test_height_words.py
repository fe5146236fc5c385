"""Altitudes come in as what they say they count from: 612msl, 650hae, altitude_datum."""

import csv
import json

import pytest

from tests.service.cli.height_questions import (
    ELLIPSOID,
    FLY,
    GEOID,
    MOON,
    MOVE,
    PLACE,
    at,
    geoid_m,
    plan,
    written,
)
from tests.service.small_maps import NORTH_M, WEST_M, small_grid

MSL = f"D1,{at(100, 200, '300msl')}"
THREE = tuple(
    word
    for name, east_m, south_m in (("A", 700, 60), ("B", 100, 200), ("C", 780, 300))
    for word in ("--anchor", f"{name},{at(east_m, south_m, '30agl')}")
)
TYPED = {
    "visibility": ("--anchor", MSL),
    "dop": (*THREE, "--anchor", MSL),
    "dop ceiling": (*THREE, "--ceiling", "600msl", "--volume"),
    "dop cut": (*THREE, "--cut", "500msl"),
    "morph": (*THREE, "--ceiling", "900msl"),
    "morph available": (*THREE, "--ceiling", "900agl", "--frames", "0,1,1", "--available-at", "600msl"),
    "los from": ("--from", at(100, 200, "300msl"), "--to", at(200, 200, "9agl")),
    "los to": ("--to", at(100, 200, "300msl"), "--from", at(200, 200, "9agl")),
    "place height": (
        "--count",
        1,
        "--spacing",
        150,
        "--height",
        "500msl",
        "--objective",
        "coverage",
        "--min-anchors",
        1,
    ),
    "place base": (*PLACE[1:], "--base", at(100, 200, "300msl"), "--link-range", 9000),
    "place anchor": (*PLACE[1:], "--anchor", MSL),
    "plan": (*plan()[1:], "--anchor", MSL),
    "fly start": ("--start", at(100, 400, "600msl"), "--goal", at(750, 70, "90agl"), "--iterations", 2000),
    "fly ceiling": (*FLY[1:], "--ceiling", "900msl"),
    "reposition": (*MOVE[1:], "--anchor", f"D9,{at(100, 210, '300msl')}"),
}


@pytest.mark.parametrize("command", TYPED)
def test_msl_is_brought_to_the_ellipsoid_where_heights_count_from_it(sightline, dem, command):
    ended = sightline(command.split()[0], dem(ELLIPSOID), *TYPED[command], "--json")
    assert ended.code == 0, ended.stderr
    (told,) = (one for one in json.loads(ended.stdout)["warnings"] if "given as msl were brought" in one)
    assert told.startswith("Altitudes given as msl were brought to the DEM's datum, ellipsoid of WGS 84: -3")


def test_masts_and_paths_say_msl_too(sightline, dem, tmp_path):
    (tmp_path / "points.geojson").write_text(
        json.dumps({"type": "MultiPoint", "coordinates_are": "metres", "coordinates": [[WEST_M + 90, NORTH_M - 90]]})
    )
    line = {
        "type": "LineString",
        "coordinates_are": "metres",
        "coordinates": [[WEST_M, NORTH_M], [WEST_M, NORTH_M - 99]],
    }
    (tmp_path / "line.geojson").write_text(json.dumps(line))
    for words in (
        (
            "place",
            dem(ELLIPSOID),
            "--count",
            1,
            "--mast",
            f"{tmp_path / 'points.geojson'},400msl",
            "--objective",
            "coverage",
            "--min-anchors",
            1,
        ),
        ("bubble", dem(ELLIPSOID), "--path", tmp_path / "line.geojson", "--height", "400msl", "--anchor", MSL),
    ):
        ended = sightline(*words, "--json")
        assert ended.code == 0, ended.stderr
        assert any("given as msl were brought" in warning for warning in json.loads(ended.stdout)["warnings"])


def test_anchors_have_the_altitude_that_their_word_means(sightline, dem):
    def altitude_m(datum, word):
        found = sightline("visibility", dem(datum), "--anchor", MSL.replace("msl", word), "--json")
        assert found.code == 0, found.stderr
        return json.loads(found.stdout)["anchors"][0]

    hae = altitude_m(ELLIPSOID, "hae")
    assert hae["altitude_m"] == 300.0
    assert altitude_m(ELLIPSOID, "msl")["altitude_m"] == pytest.approx(300.0 + geoid_m(hae), abs=1e-6)
    assert altitude_m("EGM96 geoid", "msl")["altitude_m"] == 300.0
    assert altitude_m("EGM96 geoid", "hae")["altitude_m"] == pytest.approx(300.0 - geoid_m(hae), abs=1e-6)


def test_a_ceiling_is_right_in_the_middle_of_the_dem(sightline, dem):
    grid = small_grid("EPSG:32611")
    done = sightline("morph", dem(ELLIPSOID), *THREE, "--ceiling", "900msl", "--json")
    assert done.code == 0, done.stderr
    west_m, south_m, east_m, north_m = grid.bounds_m
    middle = {"east_m": (west_m + east_m) / 2.0, "north_m": (south_m + north_m) / 2.0}
    ceiling_m = json.loads(done.stdout)["ceiling"]["altitude_m"]
    assert ceiling_m == pytest.approx(900.0 + geoid_m(middle), abs=1e-6)


def test_files_of_anchors_say_what_altitudes_count_from(sightline, dem, tmp_path):
    told, _ = written(sightline, dem(ELLIPSOID), PLACE, tmp_path / "out")
    for name in ("anchors.geojson", "anchors.csv"):
        again = sightline("visibility", dem("EGM96 geoid"), "--anchors", tmp_path / "out" / name, "--json")
        assert again.code == 0, again.stderr
        for placed, read in zip(told["placed"], json.loads(again.stdout)["anchors"], strict=True):
            assert read["altitude_m"] == pytest.approx(placed["altitude_m"] - geoid_m(placed), abs=0.01)


def test_tables_of_paths_say_what_altitudes_count_from(sightline, dem, tmp_path):
    """A path above the ellipsoid over a DEM above a geoid: its points lie as much lower as the ellipsoid does."""
    places = [(WEST_M + 100.0 + 50.0 * n, NORTH_M - 300.0) for n in range(3)]
    rows = "".join(f"{east},{north},300,hae\n" for east, north in places)
    (tmp_path / "way.csv").write_text(f"east_m,north_m,altitude_m,altitude_datum\n{rows}")
    command = ("--path", tmp_path / "way.csv", *THREE, "--out", tmp_path / "out", "--json")
    done = sightline("bubble", dem("EGM96 geoid"), *command)
    assert done.code == 0, done.stderr
    with (tmp_path / "out" / "points.csv").open(newline="") as file:
        points = list(csv.DictReader(file))
    for point, (east_m, north_m) in zip(points, places, strict=True):
        told_m = 300.0 - geoid_m({"east_m": east_m, "north_m": north_m})
        assert float(point["altitude_m"]) == pytest.approx(told_m, abs=1e-5)
        assert point["altitude_datum"] == "EGM96 geoid"


def test_two_datums_in_one_list_of_heights_are_refused(sightline, dem):
    ended = sightline("place", dem(GEOID), "--count", 1, "--spacing", 150, "--height", "400msl", "--height", "400hae")
    assert (ended.code, "all as msl, or all as hae" in ended.stderr) == (2, True)


@pytest.mark.parametrize(
    ("datum", "crs", "sentence"),
    [
        (GEOID, "EPSG:32611", None),
        (None, "EPSG:32611", "does not say what its heights count from"),
        (None, MOON, "Moon has no sea level"),
        (None, None, None),
    ],
)
def test_what_msl_was_taken_for_is_told_where_it_is_not_sure(sightline, dem, datum, crs, sentence):
    anchor = f"D1,{at(100, 200, '300msl', 1.2e6 if crs == MOON else NORTH_M)}"
    found = sightline("visibility", dem(datum, crs), "--anchor", anchor, "--json")
    told = [warning for warning in json.loads(found.stdout)["warnings"] if "msl" in warning]
    assert len(told) == (sentence is not None)
    assert all(sentence in warning for warning in told)
