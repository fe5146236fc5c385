"""sightline dop and sightline morph: files that hold what the libraries answer."""

import csv
import json

import numpy as np
import pytest
import trimesh

from service.products.morphing.picture import morphing_classes
from tests.service.cli.positioning_words import ANCHORS, PLACES, band
from tests.service.small_maps import HOLE, NORTH_M, WEST_M, small_grid
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
from visibility.air import ColumnState


@pytest.fixture(scope="module")
def lines():
    grid = small_grid()
    anchors = [anchor_above_ground(grid, name, WEST_M + e, NORTH_M + n, h) for name, (e, n, h) in PLACES.items()]
    return min_visible_altitude(grid, anchors)


def test_dop_writes_what_the_library_answers(sightline, dem_file, tmp_path, lines):
    ended = sightline(
        "dop", dem_file, *ANCHORS, "--receiver-height", "2", "--dop-limit", "3", "--out", tmp_path, "--json"
    )
    told = ended.told()
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


def test_morph_writes_what_the_library_answers(sightline, dem_file, tmp_path, lines):
    ended = sightline(
        "morph", dem_file, *ANCHORS, "--ceiling", "400msl", "--dop-limit", "6", "--out", tmp_path, "--json"
    )
    told = ended.told()
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
    known = ~np.isnan(lines.grid.heights_m)
    assert {state["state"]: state["share"] for state in told["states"]} == pytest.approx(
        {state.name.lower(): np.mean(expected.state[known] == state) for state in expected.states()}
    )
    assert told["ceiling"] == {"altitude_m": 400.0, "above_ground_m": None}


def test_the_table_the_picture_and_the_answer_call_states_alike(sightline, dem_file, tmp_path):
    words = ("morph", dem_file, *ANCHORS, "--ceiling", "120msl", "--dop-limit", "6")
    told = json.loads(sightline(*words, "--json").stdout)
    names = {state["state"]: state["words"] for state in told["states"]}
    assert names["outside"] == "ground above the ceiling"
    table = sightline(*words).stdout
    assert all(name in table for name in names.values())
    above_m, state = (
        np.array([[np.nan, 5.0]], np.float32),
        np.array([[ColumnState.OUTSIDE, ColumnState.ABOVE]], np.uint8),
    )
    drawn = [kind.label for kind in morphing_classes(above_m, state, [1.0, 2.0, 3.0, 4.0])[0]]
    # heights stand in the picture for what the table has in one row; what is unknown is drawn by every map alike
    assert set(names.values()) - set(drawn) == {"from a height up", "unknown"}
    assert {label[:1] for label in drawn if label not in names.values()} <= set("<>0123456789")


@pytest.mark.parametrize(
    ("command", "more"),
    [
        ("visibility", ()),
        ("dop", ()),
        ("morph", ("--ceiling", "300agl")),
        ("place", ("--spacing", "200", "--height", "60agl")),
    ],
)
def test_a_fast_answer_says_what_it_may_be_off_by(sightline, dem_file, command, more):
    more = (*more, "--count", "1") if command == "place" else more
    statement = json.loads(sightline(command, dem_file, *ANCHORS, *more, "--json").stdout)["error_statement"]
    assert "differ from exact" in statement
    line = f"Mode fast: {statement}. Where an altitude or a single post decides, take --mode exact."
    assert line in sightline(command, dem_file, *ANCHORS, *more).stdout.splitlines()
    assert "Mode fast" not in sightline(command, dem_file, *ANCHORS, *more, "--mode", "exact").stdout


def test_a_person_gets_tables_and_paths(sightline, dem_file, tmp_path):
    ended = sightline("morph", dem_file, *ANCHORS, "--ceiling", "300agl", "--out", tmp_path)
    assert ended.code == 0
    assert "300 m" in ended.stdout
    assert "D3" in ended.stdout
    assert str(tmp_path / "altitude.tif") in ended.stdout


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


@pytest.mark.parametrize("antenna_m", [None, 40.0], ids=["usual", "told"])
def test_a_planned_path_and_a_way_of_a_bubble_are_paths_here_too(sightline, dem_file, tmp_path, antenna_m):
    ends = ("--start", f"{WEST_M + 120},{NORTH_M - 420}", "--goal", f"{WEST_M + 300},{NORTH_M - 420}")
    planned = sightline("plan", dem_file, *ends, "--max-slope", "60", "--no-sampling", "--out", tmp_path / "plan")
    assert planned.code == 0, planned.stderr
    way = list(csv.DictReader((tmp_path / "plan" / "path.csv").read_text().splitlines()))
    (tmp_path / "way.csv").write_text(
        "east_m,north_m,above_ground_m,time_s\n"
        + "".join(f"{row['east_m']},{row['north_m']},{antenna_m or 1.5},{row['time_s']}\n" for row in way)
    )
    height = () if antenna_m is None else ("--receiver-height", antenna_m)

    def table(path):
        ended = sightline("dop", dem_file, *ANCHORS, *height, "--path", path, "--out", tmp_path / "out")
        assert ended.code == 0, ended.stderr
        return list(csv.DictReader((tmp_path / "out" / "path.csv").read_text().splitlines()))

    of_the_plan, of_the_way = table(tmp_path / "plan" / "path.csv"), table(tmp_path / "way.csv")
    assert of_the_plan == of_the_way
    # the plan's own altitude is the ground's
    for row, vertex in zip(of_the_plan, way, strict=True):
        above_m = float(row["altitude_m"]) - float(vertex["altitude_m"])
        assert above_m == pytest.approx(antenna_m or 1.5, abs=2e-3)
    assert len(table(tmp_path / "plan" / "path.geojson")) >= 2


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
