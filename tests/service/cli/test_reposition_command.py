"""sightline reposition: advice, files and every wrong line told in a sentence."""

import csv
import json

import pytest

from tests.service.small_maps import NORTH_M, WEST_M

CREW = (
    *("--anchor", f"D1,{WEST_M + 700},{NORTH_M - 60},30agl"),
    *("--anchor", f"D2,{WEST_M + 100},{NORTH_M - 200},30agl"),
    *("--anchor", f"D3,{WEST_M + 780},{NORTH_M - 300},30agl"),
)
ROVER = ("--rover", f"{WEST_M + 640},{NORTH_M - 380}", "--heading", 20, "--ahead", 120)
QUESTION = (*CREW, *ROVER, "--min-anchors", 2, "--height", 60)


def verdicts(path, last="occluded", to_s=30.0):
    episodes = [{"anchor_id": "D1", "from_s": 10.0, "to_s": to_s}]
    path.write_text(json.dumps({"anchors": [{"id": "D1", "last_sight": last}], "episodes": episodes}))
    return path


def test_a_drone_is_sent_where_it_restores_what_is_asked(sightline, dem_file, tmp_path):
    done = sightline(
        "reposition", dem_file, *QUESTION, "--occluded", "D1", "--vertical-datum", "EGM96", "--out", tmp_path / "out"
    )
    assert done.code == 0, done.stderr
    assert "restored everywhere" in done.stdout
    told = json.loads((tmp_path / "out" / "reposition.json").read_text())
    assert told["restored"]
    assert told["sentence"] in done.stdout
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {
        "reposition.json",
        "moves.geojson",
        "schedule.csv",
        "anchors.csv",
        "plans.zip",
        "moves.kml",
        "map.png",
    }
    # where they stand then is the next command's input, and nobody has to move any more
    again = sightline("reposition", dem_file, "--anchors", tmp_path / "out" / "anchors.csv", *QUESTION[6:], "--json")
    assert json.loads(again.stdout)["moves"] == []


def test_a_replayed_log_tells_who_is_occluded_for_good(sightline, dem_file, tmp_path):
    def occluded(path, *more):
        done = sightline("reposition", dem_file, *QUESTION, "--verdicts", path, *more, "--json")
        assert done.code == 0, done.stderr
        return json.loads(done.stdout)["occluded"]

    assert occluded(verdicts(tmp_path / "detection.json")) == ["D1"]
    assert occluded(verdicts(tmp_path / "detection.json"), "--persistent", 25) == []
    assert occluded(verdicts(tmp_path / "detection.json", last="clear")) == []


def test_a_crew_follows_a_path(sightline, dem_file, tmp_path):
    line = {"type": "LineString", "coordinates": [[WEST_M + 60, NORTH_M - 400], [WEST_M + 800, NORTH_M - 400]]}
    path = tmp_path / "path.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [line], "coordinates_are": "metres"}))
    words = (*CREW, "--min-anchors", 2, "--height", 60, "--path", path, "--stretch", 250, "--out", tmp_path)
    done = sightline("reposition", dem_file, *words, "--json")
    told = done.told()
    assert len(told["stretches"]) == 3
    rows = list(csv.DictReader((tmp_path / "schedule.csv").read_text().splitlines()))
    assert [float(row["start_s"]) for row in rows] == sorted(move["start_s"] for move in told["moves"])


def test_a_request_in_a_file_is_taken_as_over_http(sightline, dem_file, tmp_path):
    anchors = [
        {"id": name, "east_m": WEST_M + east_m, "north_m": NORTH_M - south_m, "above_ground_m": 30.0}
        for name, east_m, south_m in (("D1", 700.0, 60.0), ("D2", 100.0, 200.0), ("D3", 780.0, 300.0))
    ]
    place = {"east_m": WEST_M + 640.0, "north_m": NORTH_M - 380.0}
    asked = {
        "dem_id": "d1", "detector_id": "s1", "persistent_s": 5.0, "anchors": anchors, "occluded": ["D1"],
        "rover": {"place": place, "heading_deg": 20.0, "ahead_m": 120.0}, "goal": {"min_anchors": 2},
        "heights_above_ground_m": [60.0],
    }  # fmt: skip
    (tmp_path / "request.json").write_text(json.dumps(asked))
    by_file = sightline("reposition", dem_file, "--request", tmp_path / "request.json", "--json")
    assert by_file.code == 0, by_file.stderr
    assert all(f"names a {name} of a service" in by_file.stderr for name in ("dem_id", "detector_id"))
    by_options = sightline("reposition", dem_file, *QUESTION, "--occluded", "D1", "--json")
    assert json.loads(by_file.stdout)["moves"] == json.loads(by_options.stdout)["moves"]


BAD = {
    "no way ahead": (CREW, "exactly one of path and rover"),
    "a rover without heading": ((*CREW, "--rover", "1,2"), "--rover needs --heading"),
    "a heading without rover": ((*CREW, "--heading", 20), "go with --rover"),
    "a rover of nothing": ((*CREW, "--rover", "here", "--heading", 20), "is not of the form EAST,NORTH"),
    "no anchors": (ROVER, "nothing to move"),
    "an unknown occluded anchor": ((*CREW, *ROVER, "--occluded", "X"), "no anchor X"),
    "a share of too much": ((*CREW, *ROVER, "--share", 2), "less than or equal to 1"),
    "a standing drone": ((*CREW, *ROVER, "--speed", 0), "greater than 0"),
    "no verdicts": ((*CREW, *ROVER, "--verdicts", "nowhere.json"), "cannot be read"),
    "a rover outside": ((*CREW, "--rover", "1,2", "--heading", 20), "no known ground"),
}


@pytest.mark.parametrize("what", BAD)
def test_a_wrong_line_is_told_in_one_sentence(sightline, dem_file, what):
    words, sentence = BAD[what]
    ended = sightline("reposition", dem_file, *words)
    ended.refused(sentence)


@pytest.mark.parametrize("content", ["no JSON", "[]", '{"anchors": [{}], "episodes": []}'])
def test_a_file_that_holds_no_verdicts_is_refused(sightline, dem_file, tmp_path, content):
    (tmp_path / "detection.json").write_text(content)
    ended = sightline("reposition", dem_file, *QUESTION, "--verdicts", tmp_path / "detection.json")
    assert (ended.code, "is no detection.json" in ended.stderr) == (2, True)


def test_it_is_told_to_which_heights_drones_could_move(sightline, dem_file):
    asked = sightline("reposition", dem_file, *QUESTION, "--height", 90, "--occluded", "D1", "--json")
    told = json.loads(asked.stdout)
    assert told["heights"] == "60 and 90 m above ground"
    assert {round(move["to"]["above_ground_m"], 6) for move in told["moves"]} <= {60.0, 90.0}
    usual = sightline("reposition", dem_file, *QUESTION[:-2], "--occluded", "D1")
    assert "60 and 120 m above ground, and each drone's own altitude" in " ".join(usual.stdout.split())


@pytest.mark.parametrize("command", ["place", "reposition"])
def test_the_table_of_a_plan_is_a_path_as_its_line_is(sightline, dem_file, tmp_path, command):
    ends = ("--start", f"{WEST_M + 120},{NORTH_M - 420}", "--goal", f"{WEST_M + 300},{NORTH_M - 420}")
    planned = sightline("plan", dem_file, *ends, "--max-slope", "60", "--no-sampling", "--out", tmp_path)
    assert planned.code == 0, planned.stderr
    words = {
        "place": ("--count", 1, "--spacing", 200, "--height", "60agl", "--objective", "coverage", "--min-anchors", 1),
        "reposition": (*CREW, "--min-anchors", 2, "--height", 60, "--stretch", 250),
    }[command]

    def told(path):
        answer = sightline(command, dem_file, *words, "--path", path, "--json").told()
        return {key: value for key, value in answer.items() if key not in ("files", "parameters", "timing")}

    rows = csv.DictReader((tmp_path / "path.csv").read_text().splitlines())
    line = {"type": "LineString", "coordinates": [[float(row["east_m"]), float(row["north_m"])] for row in rows]}
    (tmp_path / "metres.geojson").write_text(json.dumps({**line, "coordinates_are": "metres"}))
    assert told(tmp_path / "path.csv") == told(tmp_path / "metres.geojson")
    (tmp_path / "other.csv").write_text("east_m,north_m\n1,2\n3,4\n")
    refused = sightline(command, dem_file, *words, "--path", tmp_path / "other.csv")
    assert refused.code == 2
    assert "other.csv is not path.csv of sightline plan" in refused.stderr
