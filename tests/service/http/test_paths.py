"""Paths over HTTP: outcomes as answers, maps to plan on, files, and problems in one sentence."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from terrain import to_lon_lat
from tests.service.http.test_bad_requests import assert_problem
from tests.service.running import Server
from tests.service.small_maps import small_grid
from tests.service.small_paths import ACROSS, NO_GO, WEST_OF_WALL, at, path_request


def asked(server: Server, ground: dict[str, Any], ends: Any = WEST_OF_WALL, **changes: Any) -> Any:
    body = {"dem_id": ground["id"], **path_request(ends, **changes)}
    return server.client.post("/paths", json=body, headers={"Prefer": "wait=60"}, timeout=120.0)


@pytest.fixture(scope="module")
def found(server: Server, ground: dict[str, Any]) -> dict[str, Any]:
    answer = asked(server, ground, limits={"min_anchors": 1})
    assert answer.status_code == 201, answer.text
    return dict(answer.json())


def test_a_found_path_comes_with_totals_costs_and_the_validators_report(found: dict[str, Any]) -> None:
    result = found["result"]
    assert (found["status"], result["status"]) == ("succeeded", "found")
    assert result["validation"]["passed"]
    assert result["totals"]["length_m"] > 0.0
    assert result["ratio"] == pytest.approx(result["cost"] / result["reference_cost"])
    assert found["request"]["rover"]["max_slope_deg"] == 25.0


def test_no_path_is_an_answer_and_has_only_a_map(server: Server, ground: dict[str, Any]) -> None:
    answer = asked(server, ground, ACROSS)
    assert answer.status_code == 201
    path = answer.json()
    assert path["result"]["status"] == "unreachable"
    assert path["result"]["unreachable"]["reason"] == "slope"
    slope = path["result"]["unreachable"]["relaxations"][0]
    assert slope["unit"] == "deg"
    # the numbers are those of the sentence: "with slopes up to 63.35 deg instead of 20.00 deg"
    assert f"up to {slope['needed']:.2f} deg instead of {slope['asked']:.2f} deg" in slope["sentence"]
    assert slope["shown"] is True
    assert slope["least"] <= slope["needed"] <= slope["least"] + 0.011
    assert path["result"]["unreachable"]["grain"]["width_m"] >= 0.0
    blocked = server.client.get(f"{path['links']['self']}/layers/path.geojson").json()["features"][-1]["properties"]
    assert (blocked["what"], blocked["grain"]) == ("blocked", path["result"]["unreachable"]["grain"])
    assert [layer["name"] for layer in path["layers"]] == ["path.geojson", "map.png"]
    missing = server.client.get(f"{path['links']['self']}/layers/path.gpx")
    assert_problem(missing, 404, "not-found", "There is no layer 'path.gpx'")


def test_the_same_question_in_two_jobs_has_the_same_path(server: Server, ground: dict[str, Any]) -> None:
    tables = []
    for _ in range(2):
        body = {"dem_id": ground["id"], **path_request(seed=11, budget={"iterations": 500})}
        path = server.client.post("/paths", json=body, headers={"Prefer": "wait=60"}).json()
        tables.append(server.client.get(f"{path['links']['self']}/layers/path.csv").text)
    assert tables[0] == tables[1]


def lon_lat(place: dict[str, float]) -> list[float]:
    return [float(angle) for angle in to_lon_lat(small_grid(), place["east_m"], place["north_m"])]


def test_a_question_may_be_all_geojson(server: Server, ground: dict[str, Any]) -> None:
    corners = [at(5, 455), at(525, 455), at(525, 5), at(5, 5), at(5, 455)]
    body = {
        "dem_id": ground["id"],
        "budget": {"sampling": False},
        "start": {"type": "Point", "coordinates": lon_lat(WEST_OF_WALL[0])},
        "goals": [{"type": "Feature", "geometry": {"type": "Point", "coordinates": lon_lat(WEST_OF_WALL[1])}}],
        "keep_in": {"type": "Polygon", "coordinates": [[lon_lat(corner) for corner in corners]]},
    }
    answer = server.client.post("/paths", json=body, headers={"Prefer": "wait=60"})
    assert answer.status_code == 201, answer.text
    assert answer.json()["result"]["status"] == "found"


@pytest.mark.parametrize(
    ("resource", "asked_for"),
    [
        ("/visibility-maps", {"receiver_above_ground_m": 2.5}),
        ("/dop-maps", {"dop_limit": 600.0, "receiver_above_ground_m": 2.5}),
        ("/morphing-maps", {"dop_limit": 600.0, "ceiling_above_ground_m": 40.0}),
    ],
)
def test_a_path_is_planned_on_a_finished_map(
    server: Server, ground: dict[str, Any], resource: str, asked_for: dict[str, Any]
) -> None:
    anchors = path_request()["anchors"]
    made = server.client.post(
        resource, json={"dem_id": ground["id"], "anchors": anchors, **asked_for}, headers={"Prefer": "wait=60"}
    )
    assert made.status_code == 201, made.text
    ends = {"start": at(220.0, 430.0), "goals": [at(300.0, 350.0)], "budget": {"sampling": False}}
    body = {"dem_id": ground["id"], "map_id": made.json()["id"], **ends}
    answer = server.client.post("/paths", json=body, headers={"Prefer": "wait=60"})
    assert answer.status_code == 201, answer.text
    request = answer.json()["request"]
    assert answer.json()["result"]["status"] == "found"
    if resource == "/morphing-maps":
        assert request["morphing_map"]["dop_limit"] == 600.0
    else:
        assert [anchor["id"] for anchor in request["anchors"]] == ["W", "N", "S", "E"]
        assert request["rover"]["receiver_above_ground_m"] == 2.5
    if resource == "/dop-maps":
        assert request["limits"]["dop_limit"] == 600.0


def test_a_map_that_is_not_there_or_of_another_dem_is_refused(
    server: Server, ground: dict[str, Any], jacksboro: dict[str, Any]
) -> None:
    body = {"dem_id": ground["id"], "start": at(45.0, 430.0), "goals": [at(470.0, 70.0)], "map_id": "nowhere"}
    assert_problem(server.client.post("/paths", json=body), 404, "not-found", "There is no map 'nowhere'")
    anchors = path_request()["anchors"]
    made = server.client.post(
        "/visibility-maps", json={"dem_id": ground["id"], "anchors": anchors}, headers={"Prefer": "wait=60"}
    ).json()
    answer = server.client.post("/paths", json={**body, "dem_id": jacksboro["id"], "map_id": made["id"]})
    assert_problem(answer, 422, "request", "is of another DEM")
    both = server.client.post("/paths", json={**body, "anchors": anchors, "map_id": made["id"]})
    assert_problem(both, 422, "request", "A map brings its own anchors along")


def test_older_names_are_taken_and_the_result_warns_of_them(server: Server, ground: dict[str, Any]) -> None:
    older = {"rover": {"antenna_height_m": 2.5}, "limits": {"max_dop": 900.0}}
    path = asked(server, ground, (at(220.0, 430.0), at(300.0, 350.0)), **older).json()
    assert path["request"]["rover"]["receiver_above_ground_m"] == 2.5
    assert path["request"]["limits"]["dop_limit"] == 900.0
    told = " ".join(path["result"]["warnings"])
    assert "antenna_height_m is called receiver_above_ground_m now" in told
    assert "max_dop is called dop_limit now" in told
    both = asked(server, ground, limits={"max_dop": 900.0, "dop_limit": 900.0})
    assert_problem(both, 422, "validation", "max_dop is the older name of dop_limit; give only the new one.")


TRACK = {"id": "T", "points": [{"time_s": t, **at(60.0 + t, 60.0), "above_ground_m": 80.0} for t in (0.0, 400.0)]}
CROSSED = {"ring": [at(0, 0), at(100, 100), at(100, 0), at(0, 100)]}
METRES = {"type": "Polygon", "coordinates": [[[4e5, 3.8e6], [4e5, 3.9e6], [5e5, 3.8e6], [4e5, 3.8e6]]]}


@pytest.mark.parametrize(
    ("changes", "name", "sentence"),
    [
        ({"start": at(-500.0, 0.0)}, "place", "The start lies outside the DEM; the nearest allowed place with a way"),
        ({"start": at(300.0, 100.0)}, "place", "The start cannot be stood on: unknown ground"),
        ({"goals": [at(540.0, 200.0)]}, "place", "The goal cannot be stood on: slope"),
        ({"start": at(225.0, 250.0)}, "place", "The start cannot be stood on: no-go area"),
        ({"goals": [WEST_OF_WALL[0]]}, "path-problem", "the same place, so there is no path to plan"),
        ({"limits": {"min_anchors": 5}}, "path-problem", "5 anchors in sight are asked for, and there are only 4."),
        ({"limits": {"dop_limit": 0.01}}, "no-coverage", "Nowhere on the map is the dilution below 0.01"),
        ({"weights": {"length": 0.0}}, "path-problem", "A path must cost something for each metre"),
        ({"no_go": [CROSSED]}, "request", "no_go[0] is no polygon: Self-intersection"),
        ({"keep_in": METRES}, "validation", "which are no longitude and latitude"),
        (
            {"no_go": {**METRES, "crs": {"properties": {"name": "EPSG:32611"}}}},
            "validation",
            "is in the CRS 'EPSG:32611'",
        ),
        ({"budget": {"seconds": 0.0}}, "validation", "budget.seconds"),
        ({"budget": {"iterations": 0}}, "validation", "budget.iterations"),
        ({"anchors": [], "limits": {"bubble_epsilon": 2.0}}, "validation", "bubble need anchors, satellites, or a map"),
        ({"tracks": [TRACK | {"id": "W"}]}, "validation", "ids that are unique among all of them"),
        ({"tracks": [TRACK], "curvature": "flat"}, "validation", "unknown and curvature keep their defaults"),
        ({"tracks": [TRACK], "departure_s": -5.0}, "visibility-input", "nothing is known of it at -5 s"),
        ({"budget": {"seconds": 1e6}}, "limit", "A budget of 1e+06 s is more than the limit of 900 s for one job"),
        ({"rover": {"footprint_radius_m": 1e6}}, "path-problem", "A footprint of 1e+06 m radius has no room on a DEM"),
        ({"rover": {"footprint_radius_m": 1e308}}, "validation", "rover.footprint_radius_m"),
        ({"rover": {"min_turning_radius_m": 1e12}}, "path-problem", "min_turning_radius_m must be 0, for a rover that"),
        ({"goals": []}, "validation", "goals"),
        ({"goals": [{"type": "LineString", "coordinates": [[0, 0], [1, 1]]}]}, "validation", "goal holds no polygons"),
        ({"anchors": [], "limits": {"min_anchors": 1}}, "validation", "need anchors, satellites, or a map of them"),
    ],
)
def test_a_question_that_makes_no_sense_is_refused_in_one_sentence(
    server: Server, ground: dict[str, Any], changes: dict[str, Any], name: str, sentence: str
) -> None:
    answer = asked(server, ground, **changes)
    assert_problem(answer, 422, name, sentence)


def test_where_the_rover_cannot_stand_programs_read_why_and_what_is_nearest(
    server: Server, ground: dict[str, Any]
) -> None:
    problem = asked(server, ground, start=at(540.0, 200.0)).json()
    assert (problem["place"], problem["reasons"]) == ("start", ["slope"])
    assert np.hypot(*np.subtract(problem["nearest_m"], list(at(540.0, 200.0).values()))) < 60.0


def test_no_anchor_in_sight_anywhere_is_told(server: Server, ground: dict[str, Any]) -> None:
    far = [{"id": "F", **at(-900.0, 305.0), "altitude_m": 200.0, "max_range_m": 250.0}]
    answer = asked(server, ground, anchors=far, limits={"min_anchors": 1}, no_go=[NO_GO])
    assert_problem(answer, 422, "no-coverage", "Nowhere on the map")
