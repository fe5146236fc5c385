"""Repositionings over HTTP: who moves where, with what a detector session finds, and problems in one sentence."""

from __future__ import annotations

import csv
import io
import json
import math
import zipfile
from typing import Any

import pytest

from planning.placement import Flight, Goal, MoveQuestion, reposition, straight_ahead
from service.parts.anchors import AnchorIn
from service.parts.shapes_in_grid import resolve_anchor
from tests.service.http.test_bad_requests import assert_problem
from tests.service.running import Server
from tests.service.small_maps import small_grid

# the small ground: a slope with a wall of 60 m from north to south; two drones west of it see nothing in its east
WEST_M, NORTH_M = 400_000.0, 3_800_000.0
ANCHORS = [
    {"id": "D1", "east_m": WEST_M + 700.0, "north_m": NORTH_M - 60.0, "above_ground_m": 30.0},
    {"id": "D2", "east_m": WEST_M + 100.0, "north_m": NORTH_M - 200.0, "above_ground_m": 30.0},
    {"id": "D3", "east_m": WEST_M + 780.0, "north_m": NORTH_M - 300.0, "above_ground_m": 30.0},
]
ROVER = {"place": {"east_m": WEST_M + 640.0, "north_m": NORTH_M - 380.0}, "heading_deg": 20.0, "ahead_m": 120.0}
GOAL = {"objective": "coverage", "min_anchors": 2}


def asked(server: Server, ground: dict[str, Any], **request: Any) -> Any:
    body = {"dem_id": ground["id"], "anchors": ANCHORS, "rover": ROVER, "goal": GOAL, **request}
    return server.client.post("/repositionings", json=body, headers={"Prefer": "wait=60"}, timeout=120.0)


@pytest.fixture(scope="module")
def advice(server: Server, ground: dict[str, Any]) -> dict[str, Any]:
    answer = asked(server, ground, occluded=["D1"], flight={"max_flight_m": 900.0})
    assert answer.status_code == 201, answer.text
    return dict(answer.json())


def layer(server: Server, job: dict[str, Any], name: str) -> bytes:
    return server.client.get(f"{job['links']['self']}/layers/{name}").raise_for_status().content


def test_the_advice_is_the_library_s(advice: dict[str, Any]) -> None:
    grid = small_grid()
    anchors = [resolve_anchor(grid, AnchorIn.model_validate(one)) for one in ANCHORS]
    path_m = straight_ahead(WEST_M + 640.0, NORTH_M - 380.0, math.radians(20.0), 120.0)
    question = MoveQuestion(Goal("coverage", min_anchors=2), occluded=["D1"], flight=Flight(max_flight_m=900.0))
    expected = reposition(grid, anchors, path_m, question)
    result = advice["result"]
    assert expected.move is not None
    assert result["restored"] is expected.restored is True
    assert (result["before_share"], result["after_share"]) == (expected.before, expected.after)
    (move,) = result["moves"]
    assert move["anchor_id"] == expected.move.anchor.id
    assert move["flight_m"] == result["flight_m"] == expected.move.flight_m
    assert move["flight_s"] == move["end_s"] == expected.move.flight_s
    assert (move["start_s"], move["stretch"], result["waited_s"]) == (0.0, 0, 0.0)
    assert (move["to"]["east_m"], move["to"]["north_m"]) == (expected.move.to.east_m, expected.move.to.north_m)
    assert result["occluded"] == ["D1"]


def test_the_files_say_what_the_result_says(server: Server, advice: dict[str, Any]) -> None:
    (move,) = advice["result"]["moves"]
    (row,) = csv.DictReader(layer(server, advice, "schedule.csv").decode().splitlines())
    assert (row["anchor_id"], float(row["to_east_m"])) == (move["anchor_id"], move["to"]["east_m"])
    (feature,) = json.loads(layer(server, advice, "moves.geojson"))["features"]
    assert feature["properties"]["flight_m"] == move["flight_m"]
    after = {row["id"]: row for row in csv.DictReader(layer(server, advice, "anchors.csv").decode().splitlines())}
    assert set(after) == {"D1", "D2", "D3"}
    assert float(after[move["anchor_id"]]["north_m"]) == move["to"]["north_m"]
    with zipfile.ZipFile(io.BytesIO(layer(server, advice, "plans.zip"))) as archive:
        (name,) = archive.namelist()
        items = json.loads(archive.read(name))["mission"]["items"]
    assert name == f"{move['anchor_id']}.plan"
    assert [item["command"] for item in items] == [16, 16, 16, 16, 17]
    lons = [point[0] for point in feature["geometry"]["coordinates"]]
    assert [items[0]["params"][5], items[-1]["params"][5]] == pytest.approx(lons)
    altitudes = [item["Altitude"] for item in items]
    assert max(altitudes) - altitudes[0] + max(altitudes) - altitudes[-1] <= move["flight_m"]
    assert altitudes[-1] == move["to"]["altitude_m"]


def test_what_a_detector_session_finds_occluded_for_good_is_taken(server: Server, ground: dict[str, Any]) -> None:
    grid = small_grid()
    places = {one["id"]: resolve_anchor(grid, AnchorIn.model_validate(one)) for one in ANCHORS}
    more = {"D4": (WEST_M + 500.0, NORTH_M - 420.0, 90.0), "D5": (WEST_M + 860.0, NORTH_M - 440.0, 70.0)}
    more["D6"] = (WEST_M + 820.0, NORTH_M - 100.0, 130.0)
    known = {name: (a.east_m, a.north_m, a.altitude_m) for name, a in places.items()} | more
    session = server.client.post(
        "/detectors",
        json={
            "anchors": [{"id": name, "east_m": e, "north_m": n, "altitude_m": u} for name, (e, n, u) in known.items()],
            "settings": {"range_sigma_m": 0.05},
        },
    ).json()
    rover = (WEST_M + 640.0, NORTH_M - 380.0, 40.0)
    epochs = [
        {
            "time_s": float(second),
            "ranges": [
                {"anchor_id": name, "range_m": math.dist(rover, at) + (8.0 if name == "D3" and second >= 5 else 0.0)}
                for name, at in known.items()
            ],
        }
        for second in range(20)
    ]
    server.client.post(f"{session['links']['epochs']}", json={"epochs": epochs}).raise_for_status()
    for seconds, occluded in ((10.0, ["D3"]), (16.0, [])):
        answer = asked(server, ground, detector_id=session["id"], persistent_s=seconds)
        assert answer.status_code == 201, answer.text
        assert answer.json()["result"]["occluded"] == occluded
    assert_problem(asked(server, ground, detector_id="none"), 404, "not-found", "detector")


def test_drones_follow_a_long_path_stretch_by_stretch(server: Server, ground: dict[str, Any]) -> None:
    path = [{"east_m": WEST_M + e, "north_m": NORTH_M - n} for e, n in ((60.0, 400.0), (800.0, 400.0), (820.0, 60.0))]
    request = {"path": path, "rover": None, "stretch_m": 300.0, "rover_m_per_s": 2.0}
    answer = asked(server, ground, **request)
    assert answer.status_code == 201, answer.text
    result = answer.json()["result"]
    assert len(result["stretches"]) == 4
    assert result["after_share"] > result["before_share"]
    assert all(move["end_s"] <= result["stretches"][move["stretch"]]["depart_s"] + 1e-9 for move in result["moves"])


BAD: dict[str, tuple[dict[str, Any], str, str]] = {
    "neither path nor rover": ({"rover": None}, "validation", "exactly one of path and rover"),
    "an occluded anchor that is not there": ({"occluded": ["X"]}, "validation", "occluded: there is no anchor 'X'"),
    "a movable anchor that is not there": ({"movable": ["X"]}, "validation", "movable: there is no anchor 'X'"),
    "an error in metres": ({"goal": {"objective": "mean_error"}}, "validation", "restores a share"),
    "no anchors": ({"anchors": []}, "validation", "nothing to move"),
    "a rover outside": (
        {"rover": {"place": {"east_m": 0.0, "north_m": 0.0}, "heading_deg": 0.0}},
        "placement",
        "no known ground",
    ),
    "a path without end": (
        {"rover": None, "path": [{"east_m": 0.0, "north_m": 0.0}, {"east_m": 1e12, "north_m": 0.0}]},
        "placement",
        "more than 2,000,000 points",
    ),
    "stretches without end": ({"stretch_m": 1e-6}, "limit", "SIGHTLINE_MAX_JOB_S"),
    "contradictory rules": (
        {"rules": {"min_above_ground_m": 90.0, "max_above_ground_m": 30.0}},
        "placement",
        "contradict",
    ),
    "an anchor under the ground": (
        {"anchors": [{"id": "D1", "east_m": WEST_M + 90.0, "north_m": NORTH_M - 90.0, "altitude_m": -500.0}]},
        "anchor",
        "ground",
    ),
}


@pytest.mark.parametrize("what", BAD)
def test_a_repositioning_that_cannot_be_is_refused_in_one_sentence(
    server: Server, ground: dict[str, Any], what: str
) -> None:
    request, kind, word = BAD[what]
    assert_problem(asked(server, ground, **request), 422, kind, word)
