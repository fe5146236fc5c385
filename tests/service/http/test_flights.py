"""Flights over HTTP: outcomes as answers, above a finished morphing map, files, and problems in one sentence."""

from __future__ import annotations

from typing import Any

import pytest

from tests.service.http.test_bad_requests import assert_problem
from tests.service.running import Server
from tests.service.small_flights import HIGH, MAP, START, flight_request

WAIT = {"Prefer": "wait=60"}


def asked(server: Server, ground: dict[str, Any], **changes: Any) -> Any:
    body = {"dem_id": ground["id"], **flight_request(**changes)}
    return server.client.post("/flights", json=body, headers=WAIT, timeout=120.0)


def test_a_flight_above_a_finished_morphing_map_comes_with_all_its_files(
    server: Server, ground: dict[str, Any]
) -> None:
    made = server.client.post("/morphing-maps", json={"dem_id": ground["id"], **MAP}, headers=WAIT).json()
    answer = asked(server, ground, map_id=made["id"], **HIGH)
    assert answer.status_code == 201, answer.text
    flight = answer.json()
    result = flight["result"]
    assert (flight["status"], result["status"]) == ("succeeded", "found")
    assert result["totals"]["margin_m"] >= -2e-3
    assert flight["request"]["morphing_map"]["dop_limit"] == 30.0
    names = [layer["name"] for layer in flight["layers"]]
    assert names == ["flight.geojson", "flight.csv", "flight.plan", "flight.kml", "map.png", "profile.png"]
    files = {layer["name"]: server.client.get(layer["href"]) for layer in flight["layers"]}
    assert {answer.status_code for answer in files.values()} == {200}
    assert len(files["flight.plan"].json()["mission"]["items"]) == len(result["corners"])


def test_no_flight_is_an_answer(server: Server, ground: dict[str, Any]) -> None:
    answer = asked(server, ground, ceiling_altitude_m=70.0)
    assert answer.status_code == 201
    assert answer.json()["result"]["status"] == "unreachable"
    assert [layer["name"] for layer in answer.json()["layers"]] == ["flight.geojson", "map.png"]


@pytest.mark.parametrize(
    ("changes", "status", "kind", "sentence"),
    [
        ({"goal": START}, 422, "path-problem", "same place"),
        ({"map_id": "none"}, 404, "not-found", "There is no morphing-map 'none'"),
        ({"map_id": "none", "morphing_map": MAP}, 422, "validation", "only one of map_id and morphing_map"),
        ({"start": {**START, "altitude_m": 20.0}}, 422, "place", "below the floor"),
        ({"budget": {"seconds": 1e9}}, 422, "limit", "more than the limit"),
    ],
)
def test_bad_requests_are_problems_in_one_sentence(
    server: Server, ground: dict[str, Any], changes: dict[str, Any], status: int, kind: str, sentence: str
) -> None:
    assert_problem(asked(server, ground, **changes), status, kind, sentence)
