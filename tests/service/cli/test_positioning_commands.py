"""sightline dop and sightline morph: files that hold what the libraries answer, and one sentence for bad input."""

import csv
import json

import numpy as np
import pytest
import rasterio
import trimesh
from PIL import Image

from tests.service.skies import REFERENCE_DATE, TIME, almanac
from tests.service.small_maps import HOLE, NORTH_M, WEST_M, small_grid
from tests.visibility.satellites.constellation import shared_file
from visibility import (
    FlightLimit,
    anchor_above_ground,
    dop_along,
    dop_map,
    min_visible_altitude,
    morphing_map,
    position_error_map,
    visible_sets,
)

PLACES = {
    "D1": (95.0, -305.0, 120.0),
    "D2": (750.0, -90.0, 150.0),
    "D3": (400.0, -30.0, 90.0),
    "D4": (60.0, -80.0, 200.0),
}
ANCHORS = [
    word
    for name, (east_m, north_m, above_m) in PLACES.items()
    for word in ("--anchor", f"{name},{WEST_M + east_m},{NORTH_M + north_m},{above_m}agl")
]


@pytest.fixture(scope="module")
def lines():
    grid = small_grid()
    anchors = [anchor_above_ground(grid, name, WEST_M + e, NORTH_M + n, h) for name, (e, n, h) in PLACES.items()]
    return min_visible_altitude(grid, anchors)


@pytest.fixture
def almanac_file(tmp_path):
    def write(text):
        path = tmp_path / "sky.al3"
        path.write_text(text)
        return path

    return write


def band(path, number=1):
    with rasterio.open(path) as dataset:
        return dataset.read(number)


def test_dop_writes_what_the_library_answers(sightline, dem_file, tmp_path, lines):
    ended = sightline(
        "dop", dem_file, *ANCHORS, "--receiver-height", "2", "--dop-limit", "3", "--out", tmp_path, "--json"
    )
    assert ended.code == 0, ended.stderr
    told = json.loads(ended.stdout)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        [
            "dop.json",
            "dop.tif",
            "count.tif",
            "position_error.tif",
            "no_go.tif",
            "no_go.geojson",
            "contours.geojson",
            "map.png",
        ]
    )
    expected = dop_map(lines, 2.0)
    assert np.array_equal(band(tmp_path / "dop.tif"), expected.dop, equal_nan=True)
    no_go = band(tmp_path / "no_go.tif")
    assert np.array_equal(no_go, expected.no_go(3.0))
    known = ~np.isnan(small_grid().heights_m)
    assert told["share_within_limit"] == pytest.approx(np.mean(no_go[known] == 0))
    assert told["share_no_go"] + told["share_within_limit"] + told["share_unknown"] == pytest.approx(1.0)
    assert sum(told["posts_by_reason"].values()) == known.sum()
    assert told["dop_quantiles"]["p05"] == pytest.approx(
        np.quantile(expected.dop[known & ~expected.unknown], 0.05, method="inverted_cdf")
    )
    assert (band(tmp_path / "count.tif")[HOLE] == 255).all()
    assert json.loads((tmp_path / "dop.json").read_text())["measure"] == "pdop"


def test_no_go_polygons_lie_in_degrees_and_have_the_area_of_their_posts(sightline, dem_file, tmp_path):
    assert sightline("dop", dem_file, *ANCHORS, "--dop-limit", "2", "--out", tmp_path).code == 0
    zones = json.loads((tmp_path / "no_go.geojson").read_text())["features"]
    posts = np.count_nonzero(band(tmp_path / "no_go.tif") == 1)
    assert posts > 0
    assert sum(zone["properties"]["area_m2"] for zone in zones) == pytest.approx(posts * 600.0, rel=0.35)
    for zone in zones:
        for ring in zone["geometry"]["coordinates"]:
            assert ring[0] == ring[-1]
            assert all(-119.0 < lon < -118.0 and 34.0 < lat < 35.0 for lon, lat in ring)
    lines = json.loads((tmp_path / "contours.geojson").read_text())["features"]
    assert [line["properties"]["dop"] for line in lines] == [1.0, 2.0, 4.0]


def test_dop_along_the_surface_needs_one_anchor_less(sightline, dem_file):
    two = ANCHORS[:4]
    refused = sightline("dop", dem_file, *two)
    assert (refused.code, "needs at least 3 anchors; 2 are given" in refused.stderr) == (2, True)
    ended = sightline("dop", dem_file, *two, "--surface", "--json")
    assert ended.code == 0
    assert json.loads(ended.stdout)["posts_by_reason"]["ok"] > 0


def test_fewer_anchors_than_asked_for_are_no_go(sightline, dem_file, tmp_path, lines):
    assert (
        sightline("dop", dem_file, *ANCHORS, "--min-anchors", "4", "--dop-limit", "1000", "--out", tmp_path).code == 0
    )
    assert np.array_equal(band(tmp_path / "no_go.tif"), dop_map(lines, 1.5).no_go(1000.0, 4))


def test_satellites_of_an_almanac_serve_as_anchors(sightline, dem_file, tmp_path, almanac_file):
    sky = almanac_file(almanac(unhealthy=2))
    ended = sightline(
        *("dop", dem_file, "--almanac", sky, "--time", TIME, "--reference-date", REFERENCE_DATE),
        *("--kind", "pseudorange", "--measure", "gdop", "--json", "--out", tmp_path / "out"),
    )  # fmt: skip
    assert ended.code == 0, ended.stderr
    told = json.loads(ended.stdout)
    assert told["anchors"] == []
    assert len(told["satellites"]) >= 4
    assert all(5.0 - 0.3 < satellite["elevation_deg"] <= 90.0 for satellite in told["satellites"])
    assert "Satellites left out as unhealthy: G01, G02." in told["warnings"]
    with Image.open(tmp_path / "out" / "map.png") as picture:
        assert min(picture.size) > 400


def test_a_narrower_cone_takes_fewer_satellites(sightline, dem_file, almanac_file):
    words = ("dop", dem_file, "--almanac", almanac_file(almanac()), "--time", TIME, "--json", *ANCHORS)
    wide, narrow = (json.loads(sightline(*words, "--cone-deg", cone).stdout)["satellites"] for cone in (85, 40))
    assert {s["id"] for s in narrow} == {s["id"] for s in wide if s["elevation_deg"] > 50.0}


def test_morph_writes_what_the_library_answers(sightline, dem_file, tmp_path, lines):
    ended = sightline(
        "morph", dem_file, *ANCHORS, "--ceiling", "400msl", "--dop-limit", "6", "--out", tmp_path, "--json"
    )
    assert ended.code == 0, ended.stderr
    told = json.loads(ended.stdout)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        ["morph.json", "altitude.tif", "above_ground.tif", "flags.tif", "no_go.geojson", "contours.geojson", "map.png"]
    )
    expected = morphing_map(lines, FlightLimit(6.0), ceiling_m=400.0)
    assert np.array_equal(band(tmp_path / "altitude.tif"), expected.altitude_m, equal_nan=True)
    assert np.array_equal(band(tmp_path / "above_ground.tif"), expected.above_ground_m, equal_nan=True)
    assert np.array_equal(band(tmp_path / "flags.tif"), expected.state)
    assert np.array_equal(band(tmp_path / "flags.tif", 2), expected.no_flight_intervals)
    posts = {state["state"]: state["posts"] for state in told["states"]}
    assert posts == {state.name.lower(): number for state, number in expected.states().items()}
    assert posts["above"] > 0
    assert told["ceiling"] == {"altitude_m": 400.0, "above_ground_m": None}


def test_a_person_gets_tables_and_paths(sightline, dem_file, tmp_path):
    ended = sightline("morph", dem_file, *ANCHORS, "--ceiling", "300agl", "--out", tmp_path)
    assert ended.code == 0
    assert "300 m" in ended.stdout
    assert "D3" in ended.stdout
    assert str(tmp_path / "altitude.tif") in ended.stdout


ONE_LINE = [word for n in range(4) for word in ("--anchor", f"L{n},{WEST_M + 100 + 50 * n},{NORTH_M - 200},300msl")]
BAD_LINES = [
    ("dop", [], "Nothing to range to: give --anchor"),
    ("dop", ANCHORS[:4], "needs at least 3 anchors; 2 are given"),
    ("dop", [*ANCHORS[:6], "--kind", "tdoa"], "needs at least 4 anchors; 3 are given"),
    ("dop", ONE_LINE, "All 4 anchors stand on one line"),
    ("dop", [*ANCHORS, "--dop-limit", "0"], "dop_limit: Input should be greater than 0"),
    ("dop", [*ANCHORS, "--dop-limit", "nan"], "dop_limit"),
    ("dop", [*ANCHORS, "--min-anchors", "0"], "min_anchors: Input should be greater than or equal to 1"),
    ("dop", [*ANCHORS, "--min-anchors", "9"], "needs at least 9 anchors; 4 are given"),
    ("dop", [*ANCHORS, "--receiver-height", "-1"], "receiver_above_ground_m"),
    ("dop", [*ANCHORS, "--measure", "best"], "'best' is not one of"),
    ("dop", [*ANCHORS, "--time", TIME], "--time, --reference-date, --cone-deg and --sky-at need --almanac"),
    ("dop", ["--almanac", "missing.al3", "--time", TIME], "The almanac 'missing.al3' cannot be read"),
    ("morph", ANCHORS, "Give the top of the air with --ceiling"),
    ("morph", [*ANCHORS, "--ceiling", "300"], "--ceiling '300' is not of the form"),
    ("morph", [*ANCHORS, "--ceiling", "-100msl"], "is below the ground, which begins at"),
    ("morph", [*ANCHORS, "--ceiling", "0agl"], "ceiling_above_ground_m: Input should be greater than 0"),
    ("morph", [*ONE_LINE, "--ceiling", "300agl"], "All 4 anchors stand on one line"),
    ("morph", [*ANCHORS[:4], "--ceiling", "300agl"], "needs at least 3 anchors; 2 are given"),
]  # fmt: skip


@pytest.mark.parametrize(("command", "words", "sentence"), BAD_LINES, ids=[line[2][:40] for line in BAD_LINES])
def test_a_bad_line_is_refused_in_one_sentence(sightline, dem_file, tmp_path, command, words, sentence):
    ended = sightline(command, dem_file, *words, "--out", tmp_path / "out", "--json")
    assert ended.code == 2
    assert sentence in ended.stderr
    assert ended.stderr.count("\n") == 1
    assert ended.stdout == ""
    assert not list((tmp_path / "out").glob("*"))


BAD_SKIES = {
    "another week": (almanac(), ["--time", "2026-11-22T00:00:00Z", "--reference-date", REFERENCE_DATE], "days before"),
    "truncated": (almanac()[:1500], ["--time", TIME], "almanac"),
    "a missing field": (almanac().replace("  1.0000000000000E-04", "", 1), ["--time", TIME], "almanac"),
    "all unhealthy": (almanac(6, unhealthy=6), ["--time", TIME], "All 6 satellites of the almanac"),
    "empty": ("\n", ["--time", TIME], "is empty"),
    "no almanac": ("# not orbits\n", ["--time", TIME], "neither a SEM nor a YUMA almanac"),
    "no time": (almanac(), [], "--almanac needs --time"),
    "a time without offset": (almanac(), ["--time", "2007-01-27T06:00:00"], "satellites.time"),
    "no time at all": (almanac(), ["--time", "noon"], "'noon' is no ISO 8601 time"),
    "a cone beyond the horizon": (almanac(), ["--time", TIME, "--cone-deg", "120"], "satellites.cone_deg"),
    "half a place": (almanac(), ["--time", TIME, "--sky-at", "7"], "is not of the form LON,LAT"),
    "a place too many": (almanac(), ["--time", TIME, "--sky-at", "7,46"], "leave out the other place"),
}


@pytest.mark.parametrize("what", BAD_SKIES)
def test_a_sky_is_refused_in_one_sentence(sightline, dem_file, almanac_file, what):
    text, words, sentence = BAD_SKIES[what]
    ended = sightline("dop", dem_file, "--almanac", almanac_file(text), *words, "--json")
    assert ended.code == 2
    assert sentence in ended.stderr
    assert ended.stderr.count("\n") == 1
    assert ended.stdout == ""


def test_the_error_in_metres_is_that_of_the_sigmas_of_ranges_and_poses(sightline, dem_file, tmp_path):
    covariance_m2 = [[0.04, 0.0, 0.0], [0.0, 0.04, 0.0], [0.0, 0.0, 0.25]]
    anchors = [
        {
            "id": name, "east_m": WEST_M + e, "north_m": NORTH_M + n, "above_ground_m": h, "ranging_sigma_m": 0.3,
            "pose_covariance_m2": covariance_m2,
        }
        for name, (e, n, h) in PLACES.items()
    ]  # fmt: skip
    (tmp_path / "drones.json").write_text(json.dumps(anchors))
    out = tmp_path / "out"
    ended = sightline("dop", dem_file, "--anchors", tmp_path / "drones.json", "--out", out, "--json")
    assert ended.code == 0, ended.stderr
    grid = small_grid()
    weighed = [
        anchor_above_ground(
            grid, name, WEST_M + e, NORTH_M + n, h,
            ranging_sigma_m=0.3, pose_covariance_m2=tuple(tuple(row) for row in covariance_m2),
        )
        for name, (e, n, h) in PLACES.items()
    ]  # fmt: skip
    expected = position_error_map(min_visible_altitude(grid, weighed), 1.5)
    for number, name in enumerate(("horizontal_sigma_m", "vertical_sigma_m", "position_sigma_m"), start=1):
        assert np.array_equal(band(out / "position_error.tif", number), getattr(expected, name), equal_nan=True)
    assert json.loads(ended.stdout)["position_error_quantiles_m"]["position"]["p05"] > 0.3


def test_a_path_gets_a_table_of_who_is_in_sight_and_how_good_that_is(sightline, dem_file, tmp_path, lines):
    (tmp_path / "way.csv").write_text(
        f"east_m,north_m,above_ground_m\n{WEST_M + 100},{NORTH_M - 300},2\n{WEST_M + 700},{NORTH_M - 60},40\n"
    )
    ended = sightline("dop", dem_file, *ANCHORS, "--path", tmp_path / "way.csv", "--out", tmp_path / "out", "--json")
    assert ended.code == 0, ended.stderr
    assert json.loads(ended.stdout)["path_points"] == 2
    rows = list(csv.DictReader((tmp_path / "out" / "path.csv").read_text().splitlines()))
    points_m = [[float(row[name]) for name in ("east_m", "north_m", "altitude_m")] for row in rows]
    expected, sets = dop_along(lines, points_m), visible_sets(lines, points_m)
    for number, row in enumerate(rows):
        assert float(row["pdop"]) == pytest.approx(expected.pdop[number], rel=1e-6, nan_ok=True)
        seen = [anchor.id for anchor, visible in zip(lines.anchors, sets.visible()[number], strict=True) if visible]
        assert row["ids_in_sight"].split() == seen
        assert int(row["anchors_in_sight"]) == len(seen)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("east_m,north_m,above_ground_m\n", "holds no points"),
        ("x,y\n1,2\n", "unknown column 'x'"),
        ("east_m,north_m,above_ground_m\n1,2,high\n", "line 2: its cells must be numbers"),
        ("east_m,north_m\n1,2\n", "exactly one of above_ground_m and altitude_m"),
        ("east_m,north_m,above_ground_m\n0,0,2\n", "path[0] lies outside the DEM"),
    ],
)
def test_a_path_that_is_none_is_refused_in_one_sentence(sightline, dem_file, tmp_path, text, sentence):
    (tmp_path / "way.csv").write_text(text)
    ended = sightline("dop", dem_file, *ANCHORS, "--path", tmp_path / "way.csv")
    assert (ended.code, sentence in ended.stderr) == (2, True), ended.stderr


def test_the_meshes_of_the_limit_are_one_surface_in_both_formats(sightline, dem_file, tmp_path):
    ended = sightline(
        *("morph", dem_file, *ANCHORS, "--ceiling", "300msl", "--dop-limit", "4"),
        *("--mesh", "--mesh-layer", "10", "--out", tmp_path),
    )
    assert ended.code == 0, ended.stderr
    of_stl = trimesh.load_mesh(tmp_path / "surface.stl")
    of_glb = trimesh.load_scene(tmp_path / "surface.glb").to_geometry()
    assert len(of_stl.faces) == len(of_glb.faces) > 10
    # glTF's y is up and its z points south
    east_up_south = of_glb.bounds
    assert np.allclose(of_stl.bounds[:, 0], east_up_south[:, 0], atol=1e-2)
    assert np.allclose(of_stl.bounds[:, 2], east_up_south[:, 1], atol=1e-2)
    assert np.allclose(of_stl.bounds[:, 1], -east_up_south[::-1, 2], atol=1e-2)


def test_a_navigation_file_serves_as_the_precise_source(sightline, dem_file):
    orbits = shared_file("rtklib_brdc0910.09n")
    words = ("dop", dem_file, "--kind", "pseudorange", "--measure", "tdop", "--json")
    ended = sightline(*words, "--navigation", orbits, "--time", "2009-04-01T12:00:00Z")
    assert ended.code == 0, ended.stderr
    assert len(json.loads(ended.stdout)["satellites"]) >= 4
    late = sightline(*words, "--navigation", orbits, "--time", "2009-05-01T12:00:00Z")
    assert (late.code, late.stderr.count("\n")) == (2, 1)
