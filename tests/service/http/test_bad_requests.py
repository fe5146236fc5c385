"""Requests that cannot be answered: the right status and one clear sentence, and the service goes on."""

from __future__ import annotations

import json
from typing import Any

import pytest

from tests.service.running import Server

WEST_M, SOUTH_M, EAST_M, NORTH_M = 731_836.0, 4_004_807.0, 762_822.0, 4_037_355.0
MIDDLE = {"east_m": (WEST_M + EAST_M) / 2, "north_m": (SOUTH_M + NORTH_M) / 2}
GOOD = {"id": "A", **MIDDLE, "above_ground_m": 50.0}
# The warped grid's corner lies outside the degrees that the file covers.
UNKNOWN_GROUND = {"east_m": WEST_M + 50.0, "north_m": NORTH_M - 50.0}

BAD_MAPS: dict[str, tuple[dict[str, Any], str, str]] = {
    "no anchors": ({"anchors": []}, "validation", "anchors"),
    "no anchors field": ({}, "validation", "anchors"),
    "1000 anchors": ({"anchors": [{**GOOD, "id": f"A{i}"} for i in range(1000)]}, "limit", "limit of 64"),
    "an anchor below the ground": (
        {"anchors": [{"id": "A", **MIDDLE, "altitude_m": -50.0}]},
        "anchor",
        "below the ground",
    ),
    "an anchor above unknown ground": (
        {"anchors": [{"id": "A", **UNKNOWN_GROUND, "above_ground_m": 10.0}]},
        "anchor",
        "unknown ground",
    ),
    "an anchor above ground outside the DEM": (
        {"anchors": [{"id": "A", "east_m": WEST_M - 900.0, "north_m": NORTH_M, "above_ground_m": 10.0}]},
        "anchor",
        "outside the DEM",
    ),
    "an anchor 1000 km outside": (
        {"anchors": [{"id": "A", "east_m": WEST_M - 1_000_100.0, "north_m": NORTH_M, "altitude_m": 900.0}]},
        "anchor",
        "km outside",
    ),
    "duplicate ids": ({"anchors": [GOOD, GOOD]}, "validation", "unique"),
    "both heights": ({"anchors": [{**GOOD, "altitude_m": 900.0}]}, "validation", "exactly one of above_ground_m"),
    "neither height": ({"anchors": [{"id": "A", **MIDDLE}]}, "validation", "exactly one of above_ground_m"),
    "half a position": (
        {"anchors": [{"id": "A", "east_m": WEST_M, "altitude_m": 900.0}]},
        "validation",
        "exactly one of the pairs",
    ),
    "degrees beyond the pole": (
        {"anchors": [{"id": "A", "lon_deg": 0.0, "lat_deg": 91.0, "altitude_m": 9.0}]},
        "validation",
        "lat_deg",
    ),
    "a negative receiver height": (
        {"anchors": [GOOD], "receiver_above_ground_m": -1.0},
        "validation",
        "receiver_above_ground_m",
    ),
    "both receiver heights": (
        {"anchors": [GOOD], "receiver_above_ground_m": 1.0, "receiver_altitude_m": 900.0},
        "validation",
        "exactly one of receiver_above_ground_m",
    ),
    "a word for a number": ({"anchors": [{**GOOD, "east_m": "far"}]}, "validation", "anchors[0].east_m"),
    "a misspelt field": ({"anchors": [GOOD], "reciever": 3}, "validation", "reciever"),
    "an unknown mode": ({"anchors": [GOOD], "mode": "magic"}, "validation", "mode"),
    "a list for an object": ({"anchors": [[1, 2, 3]]}, "validation", "anchors[0]"),
}


def assert_problem(answer: Any, status: int, kind: str, word: str) -> dict[str, Any]:
    problem = answer.json()
    assert answer.status_code == status, problem
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert problem["status"] == status
    assert problem["type"] == f"/problems/{kind}"
    assert word in problem["detail"], problem["detail"]
    assert problem["detail"].endswith((".", "?"))
    assert problem["title"]
    return dict(problem)


@pytest.mark.parametrize("what", BAD_MAPS)
def test_a_map_is_refused_at_once_with(server: Server, jacksboro: dict[str, Any], what: str) -> None:
    request, kind, word = BAD_MAPS[what]
    before = server.client.get("/visibility-maps").json()["total"]
    answer = server.client.post("/visibility-maps", json={"dem_id": jacksboro["id"], **request})
    assert_problem(answer, 422, kind, word)
    assert server.client.get("/visibility-maps").json()["total"] == before


def test_a_limit_is_named_with_its_setting_and_numbers(server: Server, jacksboro: dict[str, Any]) -> None:
    request = {"dem_id": jacksboro["id"], "anchors": [{**GOOD, "id": f"A{i}"} for i in range(1000)]}
    problem = assert_problem(
        server.client.post("/visibility-maps", json=request), 422, "limit", "SIGHTLINE_MAX_ANCHORS"
    )
    assert (problem["limit_name"], problem["limit"], problem["given"]) == ("max_anchors", 64, 1000)


@pytest.mark.parametrize("path", ["/visibility-maps", "/lines-of-sight"])
@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999"])
def test_json_with_numbers_that_are_none_is_refused(
    server: Server, jacksboro: dict[str, Any], path: str, number: str
) -> None:
    point = f'{{"east_m": {number}, "north_m": {NORTH_M}, "altitude_m": 900.0}}'
    anchors = f"[{point.replace('{', '{' + chr(34) + 'id' + chr(34) + ': ' + chr(34) + 'A' + chr(34) + ', ')}]"
    fields = f'"anchors": {anchors}' if path == "/visibility-maps" else f'"pairs": [{{"from": {point}, "to": {point}}}]'
    body = f'{{"dem_id": "{jacksboro["id"]}", {fields}}}'
    answer = server.client.post(path, content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code in (400, 422), answer.text
    assert answer.json()["type"] in ("/problems/validation", "/problems/not-json")
    assert "east_m" in answer.json()["detail"] or "JSON" in answer.json()["detail"]


def test_what_does_not_exist_is_404_and_a_wrong_method_405(server: Server, jacksboro: dict[str, Any]) -> None:
    for path in ("/nothing", "/dems/none", "/visibility-maps/none", "/visibility-maps/none/layers/visible.tif"):
        assert server.client.get(path).json()["type"] == "/problems/not-found"
    answer = server.client.put("/dems")
    assert_problem(answer, 405, "method", "PUT")
    assert "POST" in answer.headers["Allow"]
    assert server.client.get("/dems", params={"limit": 0}).status_code == 422
    assert server.client.get("/dems", params={"offset": 10**30}).status_code == 422


BAD_LINES: dict[str, tuple[dict[str, Any], int, str, str]] = {
    "no pairs": ({"pairs": []}, 422, "validation", "At least one pair"),
    "pairs in two forms": (
        {"pairs": [{"from": MIDDLE, "to": MIDDLE}], "from_points_m": [[0, 0, 0]]},
        422,
        "validation",
        "pairs[0].from: give exactly one of",
    ),
    "neither form": ({}, 422, "validation", "either pairs or both"),
    "arrays of unequal length": (
        {"from_points_m": [[0.0, 0.0, 0.0]], "to_points_m": [[0.0, 0.0, 0.0]] * 2},
        422,
        "validation",
        "equally long",
    ),
    "a point with two numbers": (
        {"from_points_m": [[0.0, 0.0]], "to_points_m": [[0.0, 0.0, 0.0]]},
        422,
        "validation",
        "[",
    ),
    "a point over unknown ground": (
        {"pairs": [{"from": {**UNKNOWN_GROUND, "above_ground_m": 2.0}, "to": {**MIDDLE, "above_ground_m": 2.0}}]},
        422,
        "visibility-input",
        "pairs[0].from lies on unknown ground",
    ),
    "a point on another continent": (
        {"from_points_m": [[9e7, 0.0, 0.0]], "to_points_m": [[0.0, 0.0, 0.0]]},
        422,
        "visibility-input",
        "km outside the DEM",
    ),
    "more pairs than the limit": (
        {"from_points_m": [[0.0, 0.0, 0.0]] * 1001, "to_points_m": [[0.0, 0.0, 0.0]] * 1001},
        422,
        "limit",
        "SIGHTLINE_MAX_PAIRS",
    ),
    "two wavelengths": (
        {
            "from_points_m": [[0.0, 0.0, 0.0]],
            "to_points_m": [[0.0, 0.0, 0.0]],
            "wavelength_m": 0.1,
            "frequency_hz": 1e9,
        },
        422,
        "validation",
        "not both",
    ),
}


@pytest.mark.parametrize("what", BAD_LINES)
def test_lines_of_sight_are_refused_at_once_with(server: Server, jacksboro: dict[str, Any], what: str) -> None:
    request, status, kind, word = BAD_LINES[what]
    answer = server.client.post("/lines-of-sight", json={"dem_id": jacksboro["id"], **request})
    assert_problem(answer, status, kind, word)


def test_every_type_of_problem_can_be_looked_up(server: Server) -> None:
    listed = server.client.get("/problems").json()
    assert {"/problems/anchor", "/problems/limit", "/problems/not-json", "/problems/internal"} <= {
        entry["type"] for entry in listed
    }
    for entry in listed:
        assert server.client.get(entry["type"]).json() == entry


def test_preferences_that_make_no_sense_are_ignored(server: Server, jacksboro: dict[str, Any]) -> None:
    request = {"dem_id": jacksboro["id"], "anchors": [GOOD]}
    for prefer in ("wait=soon", "wait=-1", "return=minimal", json.dumps({})):
        answer = server.client.post("/visibility-maps", json=request, headers={"Prefer": prefer})
        assert answer.status_code == 202
        assert "Preference-Applied" not in answer.headers
    answer = server.client.post("/visibility-maps", json=request, headers={"Prefer": "respond-async, wait=99999"})
    assert answer.headers["Preference-Applied"] == "wait=60"
    assert answer.status_code == 201
