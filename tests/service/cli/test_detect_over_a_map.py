"""sightline detect --dem: a log judged with what a map foretells, and where its ranges contradict the map."""

import csv
import json
import math

import pytest

from dem_samples import sample_path
from terrain import height_at, read_dem

DRONES = {
    "D1": (748920.0, 4023535.5, 754.8),
    "D2": (751420.0, 4021035.5, 435.0),
    "D3": (748920.0, 4018535.5, 802.9),
    "D4": (747152.2, 4019267.7, 983.1),
    "D5": (747152.2, 4022803.2, 866.8),
}
ANCHORS = [word for name, at in DRONES.items() for word in ("--anchor", f"{name},{at[0]},{at[1]},{at[2]}msl")]


@pytest.fixture
def log(tmp_path):
    """Thirty seconds on the ground, all ranges straight but those of D4, which are 30 m too long."""
    ground = read_dem(sample_path("jacksboro"))
    rows = ["time_s,anchor_id,range_m"]
    for second in range(30):
        east_m, north_m = 750609.1 - second, 4020739.0
        place_m = (east_m, north_m, float(height_at(ground, east_m, north_m)) + 1.5)
        rows += [f"{second},{name},{math.dist(at, place_m) + 30.0 * (name == 'D4'):.3f}" for name, at in DRONES.items()]
    path = tmp_path / "drive.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def test_the_map_settles_who_lies_and_is_doubted_where_it_has_that_one_in_sight(sightline, log, tmp_path):
    told = sightline("detect", log, *ANCHORS, "--dem", sample_path("jacksboro"), "--out", tmp_path / "out")
    assert told.code == 0, told.stderr
    with (tmp_path / "out" / "verdicts.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    later = [row for row in rows if int(row["epoch"]) > 5]
    assert {row["anchor_id"] for row in later if row["occluded"] == "1"} == {"D4"}
    assert min(float(row["p_sight"]) for row in later if row["anchor_id"] == "D4") > 0.9
    collection = json.loads((tmp_path / "out" / "map_doubts.geojson").read_text())
    (doubt,) = collection["features"]
    assert doubt["properties"]["anchor_id"] == "D4"
    assert doubt["properties"]["expected"] == "in sight"
    assert doubt["properties"]["excess_m"] == pytest.approx(30.0, abs=3.0)
    assert 240.0 < doubt["properties"]["bearing_deg"] < 260.0
    assert doubt["geometry"]["coordinates"][0] == pytest.approx([-84.2, 36.3], abs=0.1)
    assert "Ranges contradict the map in 1 stretches, of D4" in told.stdout + told.stderr


def test_what_it_says_of_the_map_maps_and_the_next_replay_take_back(sightline, log, tmp_path):
    over = [sample_path("jacksboro"), *ANCHORS]
    assert sightline("detect", log, *ANCHORS, "--dem", over[0], "--out", tmp_path / "out").code == 0
    doubts = ["--doubts", tmp_path / "out" / "map_doubts.geojson"]
    plain, found = (json.loads(sightline("visibility", *over, "--json", *more).stdout) for more in ([], doubts))
    shares = [{one["id"]: one["unknown_share"] for one in told["anchors"]} for told in (plain, found)]
    assert shares[1].pop("D4") > shares[0].pop("D4")
    assert shares[0] == shares[1]
    assert any("Ranges of anchor D4 contradicted its sight" in one for one in found["warnings"])
    again = sightline("detect", log, *ANCHORS, "--dem", over[0], *doubts, "--out", tmp_path / "again")
    assert json.loads((tmp_path / "again" / "map_doubts.geojson").read_text())["features"] == []
    assert again.code == 0, again.stderr
    way = tmp_path / "way.geojson"
    line = json.loads((tmp_path / "out" / "map_doubts.geojson").read_text())["features"][0]["geometry"]
    way.write_text(json.dumps(line))
    asked = ["--path", way, "--min-anchors", "4", "--max-flight", "50"]  # D2 is hidden all along
    before = [
        json.loads(sightline("reposition", *over, *asked, "--json", *more).stdout)["before_share"]
        for more in ([], doubts)
    ]
    assert before == [1.0, 0.0]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--doubts", "none.geojson"], "cannot be read"),
        (["--doubts-reach", "3"], "--doubts-reach needs --doubts FILE"),
        (["--doubts", str(sample_path("jacksboro"))], "are not GeoJSON"),
    ],
)
def test_doubts_that_cannot_be_read_are_one_sentence(sightline, words, sentence):
    told = sightline("visibility", sample_path("jacksboro"), *ANCHORS, *words)
    assert told.code == 2
    assert sentence in " ".join(told.stderr.split())


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--doubts", "DOUBTS"], "Doubts are about a DEM: give --dem too"),
        (["--estimator", "constant_velocity"], "--estimator writes estimates.csv: give --out DIR"),
    ],
)
def test_what_would_be_of_no_use_is_refused(sightline, log, tmp_path, words, sentence):
    (tmp_path / "doubts.geojson").write_text('{"type": "FeatureCollection", "features": []}')
    given = [str(tmp_path / "doubts.geojson") if word == "DOUBTS" else word for word in words]
    told = sightline("detect", log, *ANCHORS, *given)
    assert told.code == 2
    assert sentence in " ".join(told.stderr.split())


def test_without_a_map_nothing_of_one_is_written(sightline, log, tmp_path):
    assert sightline("detect", log, *ANCHORS, "--out", tmp_path / "out").code == 0
    assert not (tmp_path / "out" / "map_doubts.geojson").exists()
    assert "p_sight" not in (tmp_path / "out" / "verdicts.csv").read_text().splitlines()[0]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--dem", "nowhere.tif"], "nowhere.tif"),
        (["--dem", str(sample_path("jacksboro")), "--dem-sigma", "0"], "dem_sigma_m must be a number > 0 m"),
        (["--dem", str(sample_path("jacksboro")), "--antenna=-1"], "antenna_above_ground_m must be a number >= 0 m"),
        (["--dem", str(sample_path("jacksboro")), "--dimension", "2"], "A map is of use in three dimensions only"),
    ],
)
def test_what_cannot_be_is_one_sentence(sightline, log, words, sentence):
    told = sightline("detect", log, *ANCHORS, *words)
    assert told.code == 2
    assert sentence in " ".join(told.stderr.split())


@pytest.mark.parametrize(
    ("over", "estimator"), [(True, "constant_velocity"), (False, "constant_velocity"), (True, "hypotheses")]
)
def test_a_filter_that_goes_along_writes_its_places_and_bubbles(sightline, log, tmp_path, over, estimator):
    words = ["--dem", sample_path("jacksboro")] if over else []
    told = sightline("detect", log, *ANCHORS, *words, "--estimator", estimator, "--out", tmp_path / "out", "--json")
    assert told.code == 0, told.stderr
    assert str(tmp_path / "out" / "estimates.csv") in json.loads(told.stdout)["files"]
    with (tmp_path / "out" / "estimates.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [int(row["epoch"]) for row in rows] == list(range(int(rows[0]["epoch"]), 30))
    last = rows[-1]
    assert "D4" not in last["used"].split()
    assert math.hypot(float(last["east_m"]) - (750609.1 - 29), float(last["north_m"]) - 4020739.0) < 3.0
    assert 0.0 < float(last["sigma_m"]) < float(last["bubble_m"])


def test_a_filter_in_the_plane_is_one_sentence(sightline, log, tmp_path):
    asked = ["--dimension", "2", "--estimator", "constant_velocity", "--out", tmp_path / "out"]
    told = sightline("detect", log, *ANCHORS, *asked)
    assert told.code == 2
    assert "three dimensions" in told.stderr


def test_radios_and_trees_are_heard_of_and_refused_without_a_dem(sightline, log, tmp_path):
    over = ["--radio", "868MHz", "--canopy-height", "12", "--canopy-density", "0.2"]
    told = sightline("detect", log, *ANCHORS, "--dem", sample_path("jacksboro"), *over, "--out", tmp_path / "out")
    assert told.code == 0, told.stderr
    with (tmp_path / "out" / "verdicts.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    usable = {row["anchor_id"]: float(row["p_usable"]) for row in rows if row["p_usable"]}
    assert set(usable) == set(DRONES)
    assert all(0.0 <= p <= 1.0 for p in usable.values())
    refused = sightline("detect", log, *ANCHORS, *over)
    assert refused.code == 2
    assert "give --dem too, or leave them out" in " ".join(refused.stderr.split())


def test_the_radio_of_an_anchor_file_without_a_dem_is_told_as_unheard(sightline, log, tmp_path):
    anchors = [
        {"id": name, "east_m": east_m, "north_m": north_m, "altitude_m": altitude_m, "radio": "uwb"}
        for name, (east_m, north_m, altitude_m) in DRONES.items()
    ]
    (tmp_path / "drones.json").write_text(json.dumps(anchors))
    told = sightline("detect", log, "--anchors", tmp_path / "drones.json", "--json")
    assert told.code == 0, told.stderr
    assert "Not looked at: the radio of D1, D2, D3, D4, D5, since there is no --dem." in told.told()["warnings"]


@pytest.mark.parametrize("over", [True, False])
def test_what_a_detector_does_not_take_of_anchors_made_for_maps_is_told(sightline, log, tmp_path, over):
    anchors = [
        {"id": name, "east_m": east_m, "north_m": north_m, "altitude_m": altitude_m, "ranging_sigma_m": 0.1}
        for name, (east_m, north_m, altitude_m) in DRONES.items()
    ]
    anchors[0] |= {"max_range_m": 900.0, "min_elevation_deg": -60.0}
    anchors[2] |= {"max_range_m": 700.0, "ranging_sigma_m": 0.5}
    anchors[3]["pose_covariance_m2"] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 4.0]]
    (tmp_path / "drones.json").write_text(json.dumps(anchors))
    words = ["--dem", sample_path("jacksboro")] if over else []
    told = sightline("detect", log, "--anchors", tmp_path / "drones.json", *words, "--json")
    assert told.code == 0, told.stderr
    assert [one for one in told.told()["warnings"] if one.startswith("Not looked at")] == [
        "Not looked at: the antenna limits of D1, D3, since every range that comes is judged.",
        "Not looked at: 'ranging_sigma_m' of D3, since ranges without a sigma of their own have 0.1 m, the settings'.",
        "Not looked at: 'pose_covariance_m2' of D4, since a detector takes 'pose_sigma_m' alone.",
    ]
    # a column of the file, which is no option of the command
    shown = " ".join(sightline("detect", log, "--anchors", tmp_path / "drones.json", *words).stdout.split())
    assert "Not looked at: 'ranging_sigma_m' of D3" in shown
