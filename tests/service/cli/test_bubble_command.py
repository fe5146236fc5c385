"""sightline bubble: files that hold what the libraries answer, and one sentence for what cannot be asked."""

import csv
import json

import numpy as np
import pytest
import trimesh

import navigation
from terrain import nearest_surface, to_lon_lat
from tests.service.cli.positioning_words import ANCHORS, PLACES
from tests.service.skies import TIME, almanac
from tests.service.small_maps import NORTH_M, WEST_M, small_grid
from visibility import anchor_above_ground, min_visible_altitude, read_buildings, visible_sets
from visibility.cover import nearest_building

FILES = [
    "bubble.json",
    "map.png",
    "points.csv",
    "points.geojson",
    "points.json",
    "points.npz",
    "profile.png",
]
COUNT, ALTITUDE_M = 40, 95.0
EAST_M, NORTH_LINE_M = np.linspace(WEST_M + 120.0, WEST_M + 700.0, COUNT), NORTH_M - 250.0


@pytest.fixture
def path_file(tmp_path):
    """Along the ground and through the wall's shadow, at one altitude, a point a second."""
    lines = [f"{east_m},{NORTH_LINE_M},{ALTITUDE_M},{second}" for second, east_m in enumerate(EAST_M)]
    path = tmp_path / "way.csv"
    path.write_text("\n".join(["east_m,north_m,altitude_m,time_s", *lines]))
    return path


def test_bubble_writes_what_the_library_answers(sightline, dem_file, path_file, tmp_path):
    ended = sightline(
        "bubble", dem_file, "--path", path_file, *ANCHORS, "--range-sigma", "0.4", "--epsilon", "2",
        "--dem-sigma", "0.5", "--start-sigma", "3", "--out", tmp_path / "out", "--json",
    )  # fmt: skip
    told = ended.told()
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == FILES
    assert sorted(told["files"]) == [str(tmp_path / "out" / name) for name in FILES]
    grid = small_grid()
    drones = [anchor_above_ground(grid, name, WEST_M + e, NORTH_M + n, h) for name, (e, n, h) in PLACES.items()]
    points_m = np.column_stack([EAST_M, np.full(COUNT, NORTH_LINE_M), np.full(COUNT, ALTITUDE_M)])
    sets = visible_sets(min_visible_altitude(grid, drones), points_m)
    start = navigation.initial_state(0.0, points_m[0], position_sigma_m=3.0, velocity_sigma_m_per_s=1.0)
    bubble = navigation.predict_bubble(
        points_m,
        np.arange(COUNT),
        [(drone.east_m, drone.north_m, drone.altitude_m) for drone in drones],
        sets.visible(),
        0.4,
        initial_covariance=start.covariance,
        epsilon=2.0,
        dem_sigma_m=0.5,
    )
    rows = list(csv.DictReader((tmp_path / "out" / "points.csv").read_text().splitlines()))
    radius_m, clearance_m = bubble.radius_m, nearest_surface(grid, points_m).distance_m
    np.testing.assert_allclose([float(row["radius_m"]) for row in rows], radius_m, atol=1e-5)
    np.testing.assert_allclose([float(row["margin_m"]) for row in rows], clearance_m - radius_m, atol=1e-5)
    assert told["violated"] == np.count_nonzero(clearance_m < radius_m)
    assert told["least_margin_m"] == pytest.approx((clearance_m - radius_m).min(), abs=1e-9)
    assert told["least_promise"] == pytest.approx(min(float(row["promise"]) for row in rows), abs=1e-5)
    assert told["radius_quantiles_m"]["p50"] == pytest.approx(np.median(radius_m), abs=1e-9)
    assert json.loads((tmp_path / "out" / "bubble.json").read_text())["least_margin_m"] == told["least_margin_m"]


def test_people_read_a_table_that_names_the_first_violation(sightline, dem_file, path_file):
    ended = sightline("bubble", dem_file, "--path", path_file, *ANCHORS[:2], "--range-sigma", "0.4")
    assert ended.code == 0, ended.stderr
    assert "first violation" in ended.stdout
    assert "in sight: D1" in ended.stdout


def test_a_history_of_poses_needs_no_anchors(sightline, dem_file, tmp_path):
    (tmp_path / "poses.csv").write_text(
        "time_s,east_m,north_m,above_ground_m,ee_m2,en_m2,eu_m2,nn_m2,nu_m2,uu_m2\n"
        f"5,{WEST_M + 120},{NORTH_M - 200},30,1,0,0,1,0,2\n6,{WEST_M + 130},{NORTH_M - 200},30,100,0,0,100,0,25\n"
    )
    ended = sightline("bubble", dem_file, "--path", tmp_path / "poses.csv", "--out", tmp_path, "--json")
    assert ended.code == 0, ended.stderr
    points = json.loads((tmp_path / "points.json").read_text())
    assert [point["radius_m"] for point in points] == pytest.approx([6.0, 45.0])
    assert [point["verdict"] for point in points] == ["ok", "violated"]
    assert [point["time_s"] for point in points] == [5.0, 6.0]
    assert json.loads(ended.stdout)["first_violation"]["point"] == 1


def test_a_line_of_geojson_takes_its_height_from_the_command_line(sightline, dem_file, tmp_path):
    grid = small_grid()
    corners = np.column_stack(to_lon_lat(grid, [WEST_M + 120.0, WEST_M + 300.0], [NORTH_M - 250.0, NORTH_M - 400.0]))
    line = {"type": "LineString", "coordinates": corners.tolist()}
    (tmp_path / "way.geojson").write_text(json.dumps({"type": "Feature", "geometry": line, "properties": {}}))
    ended = sightline(
        "bubble", dem_file, "--path", tmp_path / "way.geojson", "--height", "25agl", "--speed", "5", *ANCHORS,
        "--on-ground", "--out", tmp_path, "--json",
    )  # fmt: skip
    assert ended.code == 0, ended.stderr
    points = json.loads((tmp_path / "points.json").read_text())
    assert points[1]["east_m"] == pytest.approx(WEST_M + 300.0, abs=0.01)
    assert points[1]["time_s"] == pytest.approx(points[1]["distance_m"] / 5.0, abs=1e-5)
    assert points[0]["clearance_m"] == pytest.approx(25.0, abs=2.0)


def test_satellites_are_ranged_to_as_well(sightline, dem_file, path_file, tmp_path):
    (tmp_path / "sky.al3").write_text(almanac())
    ended = sightline(
        "bubble", dem_file, "--path", path_file, "--almanac", tmp_path / "sky.al3", "--time", TIME,
        "--kind", "pseudorange", "--range-sigma", "2.5", "--unknown", "open", "--json",
    )  # fmt: skip
    assert ended.code == 0, ended.stderr
    assert len(json.loads(ended.stdout)["satellites"]) >= 4


PLACE = f"{WEST_M + 120},{NORTH_M - 200}"
BAD_FILES = [
    ("east_m,north_m,altitude_m\n", [], "holds no points"),
    (f"east_m,north_m,altitude_m,time_s\n{PLACE},90,5\n{PLACE},90,4\n", [], "4 s follows 5 s at point 1"),
    (f"east_m,north_m,altitude_m,time_s\n{PLACE},90,\n", [], "line 2: time_s is empty"),
    (f"east_m,north_m,altitude_m,ee_m2\n{PLACE},90,1\n", [], "has ee_m2 but not en_m2"),
    (
        f"east_m,north_m,altitude_m,ee_m2,en_m2,eu_m2,nn_m2,nu_m2,uu_m2\n{PLACE},90,1,9,0,1,0,1\n",
        [],
        "covariances_m2[0] is not positive",
    ),
    (f"east_m,north_m,altitude_m\n{PLACE},-90\n", [], "under the ground"),
    (f"east_m,north_m,altitude_m\n{WEST_M - 500},{NORTH_M},90\n", [], "Point 0 lies outside the DEM"),
    (f"east_m,north_m,altitude_m\n{PLACE},90\n", ["--epsilon", "0"], "--epsilon: Input should be greater than 0"),
    (f"east_m,north_m,altitude_m\n{PLACE},90\n", ["--range-sigma", "0"], "its µ is missing"),
    (f"east_m,north_m,altitude_m\n{PLACE},90\n", ["--height", "9agl"], "--height is for paths in GeoJSON"),
]


@pytest.mark.parametrize(("text", "words", "sentence"), BAD_FILES, ids=[line[2][:40] for line in BAD_FILES])
def test_a_path_that_cannot_be_asked_about_is_refused(sightline, dem_file, tmp_path, text, words, sentence):
    (tmp_path / "way.csv").write_text(text)
    ended = sightline("bubble", dem_file, "--path", tmp_path / "way.csv", *ANCHORS, *words, "--out", tmp_path / "out")
    assert (ended.code, sentence in ended.stderr) == (2, True), ended.stderr
    assert ended.stderr.count("\n") == 1
    assert not list((tmp_path / "out").glob("*"))


def test_what_else_is_missing_is_told(sightline, dem_file, tmp_path, path_file):
    for words, sentence in (
        ([], "Give anchors or satellites to range to, or covariances_m2"),
        ([*ANCHORS, "--path", tmp_path / "none.csv"], "cannot be read"),
        ([*ANCHORS, "--path", tmp_path / "none.geojson"], "needs --height"),
        ([*ANCHORS, "--path", tmp_path / "none.geojson", "--height", "9"], "--height '9' is not of the form"),
        ([*ANCHORS, "--speed", "3"], "Give time_s in the file of --path or --speed, not both"),
    ):
        way = [] if "--path" in words else ["--path", path_file]
        ended = sightline("bubble", dem_file, *way, *words)
        assert (ended.code, sentence in ended.stderr) == (2, True), ended.stderr


# -- planned paths


def test_what_plan_writes_is_a_path_with_its_own_times(sightline, dem_file, tmp_path):
    start, goal = f"{WEST_M + 120},{NORTH_M - 300}", f"{WEST_M + 400},{NORTH_M - 250}"
    planned = sightline("plan", dem_file, "--start", start, "--goal", goal, "--out", tmp_path / "plan", "--no-sampling")
    assert planned.code == 0, planned.stderr
    table = tmp_path / "plan" / "path.csv"
    rows = list(csv.DictReader(table.read_text().splitlines()))
    words = (*ANCHORS, "--on-ground", "--range-sigma", "0.4", "--out", tmp_path)
    ended = sightline("bubble", dem_file, "--path", table, "--height", "1.5agl", *words)
    assert ended.code == 0, ended.stderr
    points = json.loads((tmp_path / "points.json").read_text())
    for name in ("east_m", "north_m", "time_s"):
        assert [point[name] for point in points] == pytest.approx([float(row[name]) for row in rows], abs=1e-3)
    assert points[0]["clearance_m"] == pytest.approx(1.5, abs=0.1)
    refused = sightline("bubble", dem_file, "--path", table, *words)
    assert (refused.code, "whose altitudes are the ground's" in refused.stderr) == (2, True), refused.stderr
    table.write_text(table.read_text().replace(rows[0]["time_s"], "noon", 1))
    refused = sightline("bubble", dem_file, "--path", table, "--height", "1.5agl", *words)
    assert (refused.code, "not as sightline plan writes it" in refused.stderr) == (2, True), refused.stderr
    table.write_text(",".join(rows[0]) + "\n")
    refused = sightline("bubble", dem_file, "--path", table, "--height", "1.5agl", *words)
    assert (refused.code, "holds no points" in refused.stderr) == (2, True), refused.stderr


def test_a_planned_path_has_the_error_that_the_plan_told_of_it(sightline, dem_file, tmp_path):
    start, goal = f"{WEST_M + 120},{NORTH_M - 300}", f"{WEST_M + 400},{NORTH_M - 250}"
    words = ("--no-sampling", "--out", tmp_path / "plan")
    planned = sightline("plan", dem_file, "--start", start, "--goal", goal, *ANCHORS, *words)
    assert planned.code == 0, planned.stderr
    table = tmp_path / "plan" / "path.csv"
    told_m = [float(row["position_sigma_m"]) for row in csv.DictReader(table.read_text().splitlines())]
    words = ("--height", "1.5agl", "--epsilon", 1, "--mode", "exact", "--under-ground", "violated", "--out", tmp_path)
    ended = sightline("bubble", dem_file, "--path", table, *ANCHORS, *words)
    assert ended.code == 0, ended.stderr
    points = json.loads((tmp_path / "points.json").read_text())
    assert [point["radius_m"] for point in points] == pytest.approx(told_m, rel=1e-3, abs=1e-3)


# -- buildings


@pytest.fixture
def tower_file(tmp_path):
    """A tower of 90 m beside the way, its own origin at its foot."""
    tower = trimesh.creation.box((20.0, 20.0, 90.0))
    tower.apply_translation((0.0, 0.0, 45.0))
    path = tmp_path / "tower.stl"
    path.write_bytes(tower.export(file_type="stl"))
    return path


TOWER_EAST_M, TOWER_NORTH_M = WEST_M + 300.0, NORTH_LINE_M + 15.0


def test_a_tower_beside_the_way_is_what_is_nearest_and_hides_anchors(
    sightline, dem_file, path_file, tower_file, tmp_path
):
    words = ("--path", path_file, *ANCHORS, "--range-sigma", "0.4", "--json")
    without = sightline("bubble", dem_file, *words, "--out", tmp_path / "without")
    ended = sightline(
        "bubble", dem_file, *words, "--buildings", tower_file, "--building-origin", f"{TOWER_EAST_M},{TOWER_NORTH_M}",
        "--out", tmp_path / "with",
    )  # fmt: skip
    assert ended.code == without.code == 0, ended.stderr
    told = json.loads(ended.stdout)
    assert told["buildings"]["bodies"] == 1
    assert json.loads(without.stdout)["buildings"] is None
    grid = small_grid()
    tower = read_buildings(tower_file, grid, origin_east_m=TOWER_EAST_M, origin_north_m=TOWER_NORTH_M)
    points_m = np.column_stack([EAST_M, np.full(COUNT, NORTH_LINE_M), np.full(COUNT, ALTITUDE_M)])
    walls_m, ground_m = nearest_building(tower, points_m).distance_m, nearest_surface(grid, points_m).distance_m
    points = json.loads((tmp_path / "with" / "points.json").read_text())
    np.testing.assert_allclose([point["clearance_m"] for point in points], np.minimum(walls_m, ground_m), atol=1e-5)
    assert [point["nearest"] == "building" for point in points] == (walls_m < ground_m).tolist()
    assert told["buildings"]["points_nearest"] == np.count_nonzero(walls_m < ground_m) > 0
    beside = int(np.argmin(walls_m))
    assert points[beside]["push"][1] < -0.9  # the tower is in the north
    before = json.loads((tmp_path / "without" / "points.json").read_text())
    hidden = [set(a["in_sight"]) - set(b["in_sight"]) for a, b in zip(before, points, strict=True)]
    assert any(hidden)
    assert all(set(b["in_sight"]) <= set(a["in_sight"]) for a, b in zip(before, points, strict=True))


def test_a_point_inside_a_building_is_refused_or_violated(sightline, dem_file, path_file, tower_file, tmp_path):
    inside = ("--buildings", tower_file, "--building-origin", f"{TOWER_EAST_M},{NORTH_LINE_M + 2.0}")
    words = ("--path", path_file, *ANCHORS, "--range-sigma", "0.4", *inside)
    refused = sightline("bubble", dem_file, *words)
    assert (refused.code, "lies inside a building" in refused.stderr) == (2, True), refused.stderr
    ended = sightline("bubble", dem_file, *words, "--under-ground", "violated", "--out", tmp_path, "--json")
    assert ended.code == 0, ended.stderr
    points = json.loads((tmp_path / "points.json").read_text())
    within = [point for point in points if point["clearance_m"] < 0.0]
    assert within
    assert {(point["nearest"], point["verdict"]) for point in within} == {("building", "violated")}
    assert within[0]["push_m"] == pytest.approx(within[0]["radius_m"] - within[0]["clearance_m"], abs=1e-5)


def test_buildings_that_cannot_be_used_are_refused(sightline, dem_file, path_file, tmp_path, tower_file):
    (tmp_path / "broken.stl").write_text("solid nothing")
    for words, sentence in (
        (["--buildings", tmp_path / "none.stl"], "cannot be read"),
        (["--buildings", tmp_path / "town.dxf"], "neither GeoJSON of footprints nor a mesh format"),
        (["--buildings", tmp_path / "broken.stl"], "broken.stl"),
        (["--buildings", tower_file], "no known ground below"),
        (["--buildings", tower_file, "--building-origin", "here"], "--building-origin 'here' is not of the form"),
        (["--building-origin", "1,2"], "needs --buildings"),
    ):
        ended = sightline("bubble", dem_file, "--path", path_file, *ANCHORS, *words)
        assert (ended.code, sentence in ended.stderr) == (2, True), ended.stderr


def test_bodies_without_an_inside_are_warned_about(sightline, dem_file, path_file, tmp_path):
    (tmp_path / "wall.obj").write_text("v -10 0 0\nv 10 0 0\nv 10 0 30\nv -10 0 30\nf 1 2 3\nf 1 3 4\n")
    ended = sightline(
        "bubble", dem_file, "--path", path_file, *ANCHORS, "--buildings", tmp_path / "wall.obj",
        "--building-origin", f"{TOWER_EAST_M},{TOWER_NORTH_M}", "--json",
    )  # fmt: skip
    assert ended.code == 0, ended.stderr
    assert any("1 of 1 bodies in wall.obj are open" in warning for warning in json.loads(ended.stdout)["warnings"])
