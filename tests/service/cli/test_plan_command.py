"""sightline plan, from words to files."""

import json
import re

import pytest

from service.products.paths.files import LAYERS
from terrain import read_dem, to_lon_lat
from tests.service.cli.positioning_words import ANCHORS
from tests.service.small_maps import NORTH_M, WEST_M
from tests.service.small_paths import NO_GO, at, path_request

START, GOAL, ACROSS = ("45,-430", "470,-70", "750,-70")


def place(text):
    east_m, north_m = map(float, text.split(","))
    return f"{WEST_M + east_m},{NORTH_M + north_m}"


# the sampling planner takes seconds; where it is not what is tested, the grid's way will do
QUICK = "--no-sampling"
WEST = ("--start", place(START), "--goal", place(GOAL), QUICK)


def test_a_path_is_told_and_written(sightline, dem_file, tmp_path):
    ended = sightline("plan", dem_file, *WEST, *ANCHORS, "--min-anchors", 1, "--out", tmp_path)
    assert ended.code == 0, ended.stderr
    assert "The path keeps all" in ended.stdout
    assert "longest at a stretch" in ended.stdout
    names = ["path.json", *(layer.name for layer in LAYERS if layer.needs is None)]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)
    summary = json.loads((tmp_path / "path.json").read_text())
    assert summary["status"] == "found"
    assert summary["validation"]["passed"]


def test_other_ways_are_told_and_written(sightline, dem_file, tmp_path):
    words = ("plan", dem_file, *WEST, *ANCHORS, "--alternatives", 2, "--out", tmp_path)
    told = sightline(*words, "--json").told()
    assert 1 <= len(told["alternatives"]) <= 2
    assert str(tmp_path / "alternatives.geojson") in told["files"]
    printed = sightline(*words).stdout
    assert f"Other ways: {told['alternatives_sentence'][:10]}" in printed
    assert told["alternatives"][0]["what"] in printed
    sightline(*words[:-4], "--alternatives", 9).refused("--alternatives: Input should be")
    cut = ("plan", dem_file, "--start", place(START), "--goal", place(ACROSS), QUICK, "--alternatives", 2)
    assert "Without a path there are no alternatives to it." in sightline(*cut).stdout
    sightline(*words[:-4], "--leave-by", 60).refused(
        "--leave-by goes with", "anchors that stand are the same at any time"
    )


def test_no_way_is_an_answer_and_what_an_earlier_run_wrote_is_taken_away(sightline, dem_file, tmp_path):
    assert sightline("plan", dem_file, *WEST, "--out", tmp_path).code == 0
    ended = sightline("plan", dem_file, "--start", place(START), "--goal", place(ACROSS), QUICK, "--out", tmp_path)
    assert ended.code == 0
    assert "unreachable" in ended.stdout
    assert "What would let a path through" in ended.stdout
    assert {path.name for path in tmp_path.iterdir()} == {"path.json", "path.geojson", "map.png"}


def test_json_is_all_that_is_printed_when_asked_for(sightline, dem_file):
    ended = sightline("plan", dem_file, *WEST, "--json", "--weight", "climb=0", "--weight", "out-of-sight=0")
    summary = json.loads(ended.stdout)
    assert summary["parameters"]["weights"]["climb"] == 0.0
    assert summary["files"] == []


def test_every_option_of_the_rover_reaches_the_plan(sightline, dem_file):
    words = {
        "--max-slope": (30.0, "max_slope_deg"),
        "--max-pitch": (28.0, "max_pitch_deg"),
        "--max-roll": (29.0, "max_roll_deg"),
        "--max-step": (5.0, "max_step_m"),
        "--footprint": (0.7, "footprint_radius_m"),
        "--receiver-height": (2.5, "receiver_above_ground_m"),
        "--speed": (0.4, "speed_m_per_s"),
    }
    options = [word for option, (value, _) in words.items() for word in (option, value)]
    summary = json.loads(sightline("plan", dem_file, *WEST, *options, "--json").stdout)
    rover = summary["parameters"]["rover"]
    assert {name: rover[name] for _, name in words.values()} == {name: value for value, name in words.values()}
    assert summary["totals"]["time_s"] == pytest.approx(summary["totals"]["length_m"] / 0.4, rel=1e-4)


def test_areas_and_goals_come_from_geojson_files(sightline, dem_file, tmp_path):
    ring = [[p["east_m"], p["north_m"]] for p in [*NO_GO["ring"], NO_GO["ring"][0]]]
    area = {"coordinates_are": "metres", "type": "Polygon", "coordinates": [ring]}
    (tmp_path / "no_go.geojson").write_text(json.dumps(area))
    goal = [[WEST_M + e, NORTH_M - s] for e, s in ((400, 20), (500, 20), (500, 120), (400, 120), (400, 20))]
    (tmp_path / "goal.geojson").write_text(json.dumps({**area, "coordinates": [goal]}))
    words = ("--start", place(START), "--goal", tmp_path / "goal.geojson", QUICK, "--no-go", tmp_path / "no_go.geojson")
    summary = json.loads(sightline("plan", dem_file, *words, "--json", "--via", place("200,-400")).stdout)
    assert summary["status"] == "found"
    assert summary["goals"][0]["area_m2"] == pytest.approx(10_000.0)
    assert summary["way_points"] == [at(200.0, 400.0)]


def test_a_request_under_older_names_is_taken_and_told(sightline, dem_file, tmp_path):
    ends = (at(220.0, 430.0), at(300.0, 350.0))
    asked = path_request(ends, rover={"antenna_height_m": 2.5}, limits={"max_dop": 900.0})
    (tmp_path / "request.json").write_text(json.dumps(asked))
    ended = sightline("plan", dem_file, "--request", tmp_path / "request.json", "--json")
    parameters = json.loads(ended.stdout)["parameters"]
    assert parameters["rover"]["receiver_above_ground_m"] == 2.5
    assert parameters["limits"]["dop_limit"] == 900.0
    assert "antenna_height_m is called receiver_above_ground_m now" in ended.stderr
    assert "max_dop is called dop_limit now" in ended.stderr


def test_a_request_that_names_a_map_of_a_service_needs_its_file(sightline, dem_file, tmp_path):
    ends = {"start": at(220.0, 430.0), "goals": [at(300.0, 350.0)], "budget": {"sampling": False}}
    (tmp_path / "request.json").write_text(json.dumps({"dem_id": "0" * 32, "map_id": "1" * 32, **ends}))
    without = sightline("plan", dem_file, "--request", tmp_path / "request.json")
    assert without.code == 2
    assert "names a map of a service by its map_id; give its file with --map." in without.stderr
    sightline("visibility", dem_file, *ANCHORS, "--out", tmp_path / "map")
    words = ("--request", tmp_path / "request.json", "--map", tmp_path / "map" / "visibility.json", "--json")
    ended = sightline("plan", dem_file, *words)
    assert ended.code == 0, ended.stderr
    assert "names a map_id of a service; it is passed over" in ended.stderr
    assert len(json.loads(ended.stdout)["ranged_to"]) == 4


@pytest.mark.parametrize(
    ("command", "file", "more"),
    [
        ("visibility", "visibility.json", ()),
        ("dop", "dop.json", ("--dop-limit", 500)),
        ("morph", "morph.json", ("--dop-limit", 500, "--ceiling", "40agl")),
    ],
)
def test_a_path_is_planned_on_a_map_that_another_command_wrote(sightline, dem_file, tmp_path, command, file, more):
    made = sightline(command, dem_file, *ANCHORS, *more, "--out", tmp_path / "map")
    assert made.code == 0, made.stderr
    ends = ("--start", place("220,-430"), "--goal", place("300,-350"))
    ended = sightline("plan", dem_file, *ends, "--map", tmp_path / "map" / file, QUICK, "--json")
    assert ended.code == 0, ended.stderr
    asked = json.loads(ended.stdout)["parameters"]
    anchors = asked["morphing_map"]["anchors"] if command == "morph" else asked["anchors"]
    assert [anchor["id"] for anchor in anchors] == ["D1", "D2", "D3", "D4"]
    if command == "dop":
        assert asked["limits"]["dop_limit"] == 500.0


def bad(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    return tmp_path / name


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ((), "A path needs --start EAST,NORTH and --goal EAST,NORTH (or a polygon file), or --request."),
        (("--start", "1", "--goal", "2,3"), "--start '1' is not of the form EAST,NORTH, or LON,LAT with --lonlat."),
        (
            ("--start", "1,2", "--goal", place(GOAL)),
            "The start lies outside the DEM; the nearest allowed place with a way to the goal is",
        ),
        (
            ("--start", place("540,-200"), "--goal", place(GOAL)),
            "The start cannot be stood on: slope (63.2 deg); the nearest allowed place with a way to the goal is",
        ),
        (
            ("--start", place("300,-100"), "--goal", place(GOAL)),
            "The start cannot be stood on: unknown ground; the nearest allowed place with a way to the goal is",
        ),
        (("--start", place(START), "--goal", place(START)), "same place, so there is no path to plan."),
        ((*WEST, "--time-limit", 0), "--time-limit: Input should be greater than 0"),
        ((*WEST, "--iterations", 0), "--iterations: Input should be greater"),
        (
            (*WEST, "--min-anchors", 3),
            "Limits on anchors in sight, dilution or bubble need anchors, satellites, or a map",
        ),
        ((*WEST, *ANCHORS, "--min-anchors", 5), "5 anchors in sight are asked for, and there are only 4."),
        ((*WEST, *ANCHORS, "--dop-limit", 0.01), "dilution"),
        ((*WEST, "--max-slope", 95), "--max-slope: Input should be less than or equal to 90"),
        ((*WEST, "--weight", "speed=3"), "--weight 'speed=3' is not one of length, climb, time, dop, out_of_sight"),
        ((*WEST, "--weight", "climb=1_0"), "--weight 'climb=1_0' is not of the form NAME=NUMBER."),
        ((*WEST, "--weight", "climb"), "--weight 'climb' is not of the form NAME=NUMBER."),
        ((*WEST, "--no-go", "missing.geojson"), "The file 'missing.geojson' cannot be read"),
        ((*WEST, "--time", "2007-01-27T06:00:00Z"), "need --almanac FILE."),
    ],
)
def test_bad_input_ends_with_one_sentence_and_exit_code_2(sightline, dem_file, words, sentence):
    ended = sightline("plan", dem_file, *words)
    ended.refused(sentence)


@pytest.mark.parametrize(
    ("option", "text", "sentence"),
    [
        ("--map", "[]", "holds no JSON object"),
        ("--map", '{"version": "1"}', "it is no visibility.json, dop.json or morph.json that Sightline wrote."),
        ("--map", "not", "is not JSON"),
        ("--request", "{}", "start"),
        (
            "--no-go",
            json.dumps({"type": "Polygon", "coordinates": [[[4e5, 3.8e6], [4e5, 3.9e6], [5e5, 3.8e6], [4e5, 3.8e6]]]}),
            "which are no longitude and latitude",
        ),
        (
            "--no-go",
            json.dumps({"type": "Polygon", "crs": {"properties": {"name": "EPSG:32611"}}, "coordinates": [[]]}),
            "is in the CRS 'EPSG:32611'",
        ),
        (
            "--no-go",
            json.dumps(
                {
                    "type": "Polygon",
                    "coordinates_are": "metres",
                    "coordinates": [[[4e5, 3.8e6], [400100, 3799900], [400100, 3800000], [4e5, 3799900], [4e5, 3.8e6]]],
                }
            ),
            "--no-go (number 1) is no polygon: Self-intersection",
        ),
    ],
)
def test_bad_files_end_with_one_sentence_too(sightline, dem_file, tmp_path, option, text, sentence):
    words = () if option == "--request" else WEST
    ended = sightline("plan", dem_file, *words, option, bad(tmp_path, "given.json", text))
    assert ended.code == 2
    assert sentence in ended.stderr


def test_a_map_and_anchors_together_are_refused(sightline, dem_file, tmp_path):
    sightline("visibility", dem_file, *ANCHORS, "--out", tmp_path)
    ended = sightline("plan", dem_file, *WEST, *ANCHORS, "--map", tmp_path / "visibility.json")
    assert ended.code == 2
    assert "A map brings its own anchors along" in ended.stderr


def test_a_refusal_names_a_place_in_the_degrees_it_was_asked_in_and_it_can_be_typed_back(sightline, dem_file):
    grid = read_dem(dem_file)
    degrees = [
        ",".join(map(str, to_lon_lat(grid, *map(float, at.split(","))))) for at in (place("540,-200"), place(GOAL))
    ]
    refused = sightline("plan", dem_file, "--lonlat", "--start", degrees[0], "--goal", degrees[1], QUICK)
    assert refused.code == 2
    assert " m east" not in refused.stderr
    east, north = re.search(r"is \((-?[\d.]+) deg east, (-?[\d.]+) deg north\)\.", refused.stderr).groups()
    again = sightline("plan", dem_file, "--lonlat", "--start", f"{east},{north}", "--goal", degrees[1], QUICK, "--json")
    assert json.loads(again.stdout)["status"] == "found"
