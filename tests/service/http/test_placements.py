"""Placements over HTTP: anchors, maps and plans out, and problems in one sentence."""

from __future__ import annotations

import io
import json
import zipfile
from typing import Any

import numpy as np
import pytest
import rasterio

from dem_samples import sample_path
from tests.service.http.test_bad_requests import EAST_M, NORTH_M, SOUTH_M, WEST_M, assert_problem
from tests.service.running import Server

CANDIDATES = [{"spacing_m": 5000.0, "above_ground_m": [200.0]}]
HALF = {"ring": [
    {"east_m": WEST_M, "north_m": SOUTH_M},
    {"east_m": (WEST_M + EAST_M) / 2, "north_m": SOUTH_M},
    {"east_m": (WEST_M + EAST_M) / 2, "north_m": NORTH_M},
    {"east_m": WEST_M, "north_m": NORTH_M},
]}  # fmt: skip


def asked(server: Server, **request: Any) -> Any:
    body = {"candidates": CANDIDATES, **request}
    return server.client.post("/placements", json=body, headers={"Prefer": "wait=60"}, timeout=120.0)


@pytest.fixture(scope="module")
def placement(server: Server) -> dict[str, Any]:
    ground = server.upload(sample_path("jacksboro"), vertical_datum="EGM96")
    answer = asked(
        server,
        dem_id=ground["id"],
        count=4,
        goal={"objective": "coverage", "min_anchors": 2},
        anchors=[
            {"id": "mast", "east_m": (WEST_M + EAST_M) / 2, "north_m": (SOUTH_M + NORTH_M) / 2, "above_ground_m": 40.0}
        ],
        rules={"no_fly": [HALF], "min_separation_m": 3000.0},
    )
    assert answer.status_code == 201, answer.text
    return dict(answer.json())


def test_a_placement_keeps_its_rules_and_says_what_it_is_worth(placement: dict[str, Any]) -> None:
    result = placement["result"]
    places = np.array([(p["east_m"], p["north_m"], p["altitude_m"]) for p in result["placed"]])
    assert len(places) == 4
    assert (places[:, 0] > (WEST_M + EAST_M) / 2).all()
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)[np.triu_indices(4, 1)]
    assert (apart >= 3000.0).all()
    assert result["candidates"]["removed"]["in a no-fly zone"] > 0
    assert result["before_share"] == 0.0 < result["value_share"] <= result["bound_share"] <= 1.0
    assert sum(p["marginal_share"] for p in result["placed"]) == pytest.approx(result["value_share"])
    assert result["exact_share"] == pytest.approx(result["value_share"], abs=0.01)


def test_the_maps_say_what_the_result_says(server: Server, placement: dict[str, Any]) -> None:
    content = server.client.get(f"{placement['links']['self']}/layers/count.tif").raise_for_status().content
    with rasterio.MemoryFile(content) as file, file.open() as dataset:
        before, after = dataset.read()
    known = after != 255
    assert np.mean(after[known] >= 2) == pytest.approx(placement["result"]["value_share"])
    assert set(np.unique(before[known])) == {0, 1}


def test_each_drone_has_a_plan_that_flies_to_its_place(server: Server, placement: dict[str, Any]) -> None:
    content = server.client.get(f"{placement['links']['self']}/layers/plans.zip").raise_for_status().content
    features = server.client.get(f"{placement['links']['self']}/layers/anchors.geojson").json()["features"]
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        plans = {name: json.loads(archive.read(name)) for name in archive.namelist()}
    assert set(plans) == {f"{feature['id']}.plan" for feature in features}
    for feature in features:
        last = plans[f"{feature['id']}.plan"]["mission"]["items"][-1]
        lon_deg, lat_deg = feature["geometry"]["coordinates"]
        assert last["command"] == 17
        assert last["params"][4:] == pytest.approx([lat_deg, lon_deg, feature["properties"]["altitude_m"]])


def ring(*corners: tuple[float, float]) -> dict[str, Any]:
    return {"ring": [{"east_m": east_m, "north_m": north_m} for east_m, north_m in corners]}


FAR_AWAY = ring((0.0, 0.0), (10.0, 0.0), (0.0, 10.0))
BOW_TIE = ring((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0))
FAR_BASE = {"east_m": 0.0, "north_m": 0.0, "above_ground_m": 2.0}


def lattice(spacing_m: float) -> list[dict[str, Any]]:
    return [{"spacing_m": spacing_m, "above_ground_m": [50.0]}]


BAD: dict[str, tuple[dict[str, Any], str, str]] = {
    "more anchors than candidates": ({"count": 60, "candidates": lattice(20000.0)}, "placement", "cannot be placed on"),
    "more in sight than there are": (
        {"count": 2, "goal": {"min_anchors": 5}},
        "placement",
        "5 anchors in sight are asked for, and there are only 2.",
    ),
    "no candidate left": ({"count": 1, "rules": {"max_altitude_m": -100.0}}, "no-candidate", "above the ceiling"),
    "contradictory rules": (
        {"count": 1, "rules": {"min_above_ground_m": 90.0, "max_above_ground_m": 30.0}},
        "placement",
        "contradict",
    ),
    "neither count nor reach": ({}, "validation", "exactly one of count and reach"),
    "a share of metres": ({"reach": 0.9, "goal": {"objective": "mean_error"}}, "validation", "reach is a share"),
    "an area outside the DEM": ({"count": 1, "targets": {"area": FAR_AWAY}}, "placement", "no post of the DEM"),
    "a bow tie": ({"count": 1, "rules": {"no_fly": [BOW_TIE]}}, "request", "is no polygon"),
    "too many candidates": ({"count": 4, "candidates": lattice(100.0)}, "limit", "SIGHTLINE_MAX_CANDIDATES"),
    "a share that nothing reaches": ({"reach": 1.0, "goal": {"min_anchors": 30}}, "placement", "cannot be reached"),
    "a base outside the DEM": (
        {"count": 1, "rules": {"link": {"bases": [FAR_BASE]}}},
        "visibility-input",
        "outside the DEM",
    ),
}


@pytest.mark.parametrize("what", BAD)
def test_a_placement_that_cannot_be_is_refused_in_one_sentence(
    server: Server, jacksboro: dict[str, Any], what: str
) -> None:
    request, kind, word = BAD[what]
    assert_problem(asked(server, dem_id=jacksboro["id"], **request), 422, kind, word)


def test_no_candidate_left_tells_programs_what_each_rule_removed(server: Server, jacksboro: dict[str, Any]) -> None:
    problem = asked(server, dem_id=jacksboro["id"], count=1, rules={"max_altitude_m": -100.0}).json()
    assert problem["type"] == "/problems/no-candidate"
    assert problem["removed"]["above the ceiling"] > 0


def test_the_older_name_of_min_anchors_is_taken_and_told(server: Server, jacksboro: dict[str, Any]) -> None:
    new, old = (
        asked(server, dem_id=jacksboro["id"], count=3, goal={"objective": "dop", name: 3})
        for name in ("min_anchors", "visible")
    )
    assert (new.status_code, old.status_code) == (201, 201), old.text
    results = [answer.json()["result"] for answer in (new, old)]
    note = "visible is called min_anchors now; the older name will not be taken for ever."
    assert [note in result["warnings"] for result in results] == [False, True]
    assert results[0]["placed"] == results[1]["placed"]
    assert old.json()["request"]["goal"]["min_anchors"] == results[1]["parameters"]["goal"]["min_anchors"] == 3
    both = asked(server, dem_id=jacksboro["id"], count=3, goal={"min_anchors": 3, "visible": 3})
    assert_problem(both, 422, "validation", "visible is the older name of min_anchors")
    schema = server.client.get("/openapi.json").json()["components"]["schemas"]["GoalIn"]["properties"]
    assert schema["visible"]["deprecated"]


def test_a_time_limit_answers_with_the_best_so_far(server: Server, jacksboro: dict[str, Any]) -> None:
    answer = asked(
        server,
        dem_id=jacksboro["id"],
        count=5,
        time_limit_s=0.5,
        candidates=[{"spacing_m": 1000.0, "above_ground_m": [60.0, 120.0]}],
        goal={"objective": "dop", "min_anchors": 3, "spare": 1},
    )
    assert answer.status_code == 201, answer.text
    result = answer.json()["result"]
    assert result["stopped"]
    assert 1 <= len(result["placed"]) <= 5
