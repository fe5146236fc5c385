"""Plans of a path from where the rover is by now, over HTTP: those of the library, at once; what cannot be prepared."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from planning.alternatives import prepare_replanning
from planning.validation import validate_path
from service.products.paths.question import path_question, path_sources
from service.products.paths.request import PathParameters
from tests.service.http.test_bad_requests import assert_problem
from tests.service.http.test_paths import asked, lon_lat
from tests.service.running import Server
from tests.service.small_maps import small_grid
from tests.service.small_paths import ACROSS, NO_GO, WEST_OF_WALL, at, path_request
from tests.service.test_path_choices import TRACK

JSON = {"Content-Type": "application/json"}
ELSEWHERE = (at(100.0, 300.0), at(430.0, 300.0), at(500.0, 40.0))
STANDING = {"limits": {"min_anchors": 1}}


def path_of(server: Server, ground: dict[str, Any], ends: Any = WEST_OF_WALL, **changes: Any) -> str:
    answer = asked(server, ground, ends, **changes)
    assert answer.status_code == 201, answer.text
    return str(answer.json()["links"]["self"])


def again(server: Server, path: str, start: Any, **more: Any) -> Any:
    return server.client.post(f"{path}/replans", json={"start": start, **more})


def test_from_anywhere_the_answer_is_the_plan_of_the_library_and_the_validator_passes_it(
    server: Server, ground: dict[str, Any]
) -> None:
    path = path_of(server, ground, **STANDING)
    grid, parameters = small_grid(), PathParameters.model_validate(path_request(**STANDING))
    prepared = prepare_replanning(path_question(grid, parameters, path_sources(grid, parameters)))
    kept = server.client.get("/paths").json()["total"]
    for start in ELSEWHERE:
        answer = again(server, path, start)
        assert answer.status_code == 200, answer.text
        told = answer.json()
        place = (start["east_m"], start["north_m"])
        expected = prepared.plan_from(place, anew=False)
        assert expected.path is not None
        assert (told["status"], told["sentence"]) == ("found", expected.sentence)
        assert told["start"] == start
        assert told["cost"] == pytest.approx(expected.path.cost)
        corners = np.array([(corner["east_m"], corner["north_m"]) for corner in told["corners"]])
        of_library = np.column_stack([expected.path.east_m, expected.path.north_m])[expected.path.corners]
        np.testing.assert_allclose(corners, of_library, atol=1e-6)
        assert validate_path(replace(prepared.problem, start=place), corners).passed
        first, last = told["corners"][0], told["corners"][-1]
        assert [first["lon_deg"], first["lat_deg"]] == pytest.approx(lon_lat(start), abs=1e-9)
        assert last["time_s"] == pytest.approx(told["totals"]["time_s"])
        assert last["distance_m"] == pytest.approx(told["totals"]["length_m"])
        assert told["validation"]["passed"]
    assert server.client.get("/paths").json()["total"] == kept


def test_a_start_may_be_geojson_and_a_path_that_was_none_may_be_one_from_elsewhere(
    server: Server, ground: dict[str, Any]
) -> None:
    path = path_of(server, ground, ACROSS)
    nowhere = again(server, path, at(100.0, 300.0)).json()
    assert (nowhere["status"], nowhere["corners"], nowhere["totals"]) == ("out_of_budget", [], None)
    assert "plan it anew" in nowhere["sentence"]
    beyond = again(server, path, {"type": "Point", "coordinates": lon_lat(at(700.0, 300.0))}).json()
    assert beyond["status"] == "found"
    assert beyond["start"]["east_m"] == pytest.approx(at(700.0, 300.0)["east_m"], abs=1e-3)


def test_what_stands_on_the_ground_of_a_path_stands_there_when_it_is_planned_again(
    server: Server, ground: dict[str, Any]
) -> None:
    ring = [[lon + east, lat + north] for lon, lat in [lon_lat(at(330.0, 120.0))] for east, north in
            ((0.0, 0.0), (3e-4, 0.0), (3e-4, 3e-4), (0.0, 3e-4), (0.0, 0.0))]  # fmt: skip
    house = {"type": "Feature", "properties": {"height": 8.0}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
    cover = {"footprints": {"geojson": {"type": "FeatureCollection", "features": [house]}}}
    path = path_of(server, ground, cover=cover)
    inside = at(330.0 + 13.0, 120.0 - 16.0)
    blocked = again(server, path, inside)
    assert_problem(blocked, 422, "place", "start")
    assert again(server, path, at(100.0, 300.0)).json()["status"] == "found"


def test_what_cannot_be_planned_again_is_told_in_a_sentence(server: Server, ground: dict[str, Any]) -> None:
    path, elsewhere = path_of(server, ground), at(100.0, 300.0)
    assert_problem(again(server, path, at(-5000.0, 300.0)), 422, "place", "start")
    middle = at(225.0, 250.0)  # of the area that may not be driven
    assert NO_GO["ring"][0]["east_m"] < middle["east_m"] < NO_GO["ring"][1]["east_m"]
    assert_problem(again(server, path, middle), 422, "place", "start")
    assert_problem(again(server, path, elsewhere, goals=[]), 422, "validation", "goals")
    assert_problem(server.client.post(f"{path}/replans", content=b"{", headers=JSON), 400, "not-json", "JSON")
    assert_problem(again(server, "/paths/" + "0" * 32, elsewhere), 404, "not-found", "path")
    passing = path_of(server, ground, way_points=[elsewhere])
    assert_problem(again(server, passing, elsewhere), 422, "path-problem", "without way-points")
    moving = path_of(server, ground, anchors=[], tracks=[TRACK], limits={"in_sight_from": 1})
    assert_problem(again(server, moving, elsewhere), 422, "path-problem", "anchors that stand")
