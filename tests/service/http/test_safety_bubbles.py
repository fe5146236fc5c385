"""Safety bubbles over HTTP: what cannot be asked is refused at once, in one sentence."""

from __future__ import annotations

import base64
from typing import Any

import pytest

from tests.service.http.test_bad_requests import EAST_M, NORTH_M, SOUTH_M, UNKNOWN_GROUND, WEST_M, assert_problem
from tests.service.running import Server
from tests.service.skies import REFERENCE_DATE, TIME, almanac

MIDDLE = ((WEST_M + EAST_M) / 2, (SOUTH_M + NORTH_M) / 2)
HIGH = [*MIDDLE, 1200.0]
ANCHOR = {
    "id": "D1",
    "east_m": MIDDLE[0] + 900.0,
    "north_m": MIDDLE[1],
    "above_ground_m": 90.0,
    "ranging_sigma_m": 0.5,
}
ONE = {"points_m": [HIGH], "anchors": [ANCHOR]}
TWO = {"points_m": [HIGH, HIGH], "anchors": [ANCHOR]}
POSES = {"points_m": [HIGH, HIGH], "times_s": [0.0, 1.0]}
TENT = b"v -20 -20 0\nv 20 -20 0\nv 20 20 0\nv -20 20 0\nv 0 0 2000\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n"


def encoded(data: bytes) -> str:
    return base64.b64encode(data).decode()


TOWER = {"name": "tower.obj", "base64": encoded(TENT)}
ROUND = [1.0, 0.0, 0.0, 1.0, 0.0, 1.0]

BAD: dict[str, tuple[dict[str, Any], str, str]] = {
    "no points": ({"points_m": [], "anchors": [ANCHOR]}, "validation", "At least one point"),
    "points in two forms": ({**ONE, "points": []}, "validation", "either points or points_m"),
    "nothing to range to": ({"points_m": [HIGH]}, "validation", "anchors or satellites"),
    "times and a speed": ({**ONE, "times_s": [0.0], "speed_m_per_s": 2.0}, "validation", "not both"),
    "too few times": ({**TWO, "times_s": [0.0]}, "validation", "one entry for each of the 2 points"),
    "times going backwards": ({**TWO, "times_s": [1.0, 0.5]}, "time-order", "0.5 s follows 1 s at point 1"),
    "a covariance too few": ({**POSES, "covariances_m2": [ROUND]}, "validation", "one entry for each"),
    "a covariance that is not positive": (
        {**POSES, "covariances_m2": [ROUND, [1.0, 5.0, 0.0, 1.0, 0.0, 1.0]]},
        "bubble",
        "covariances_m2[1] is not positive",
    ),
    "a covariance that is not symmetric in size": ({**POSES, "covariances_m2": [ROUND, ROUND[:5]]}, "validation", "["),
    "an epsilon of zero": ({**ONE, "epsilon": 0.0}, "validation", "epsilon"),
    "an epsilon whose bubble has no size": ({**ONE, "epsilon": 1e308}, "validation", "epsilon"),
    "a DEM beyond all measure unsure": ({**ONE, "dem_sigma_m": 1e308}, "validation", "dem_sigma_m"),
    "times at the end of numbers": ({**TWO, "times_s": [0.0, 1e308]}, "validation", "times_s[1]"),
    "an anchor whose µ is beyond measure": (
        {"points_m": [HIGH], "anchors": [{**ANCHOR, "ranging_sigma_m": 1e308}]},
        "validation",
        "ranging_sigma_m",
    ),
    "covariances that overflow": (
        {**POSES, "covariances_m2": [ROUND, [1e308, 0.0, 0.0, 1.0, 0.0, 1.0]]},
        "validation",
        "covariances_m2[1]",
    ),
    "a negative epsilon": ({**ONE, "epsilon": -3.0}, "validation", "epsilon"),
    "an anchor without its µ": (
        {"points_m": [HIGH], "anchors": [{**ANCHOR, "ranging_sigma_m": 0.0}]},
        "measurement",
        "its µ is missing",
    ),
    "a pose under the ground": ({**ONE, "points_m": [[*MIDDLE, 10.0]]}, "bubble", "under the ground"),
    "a path that leaves the DEM": (
        {**ONE, "points_m": [HIGH, [WEST_M - 500.0, NORTH_M, 900.0]]},
        "bubble",
        "Point 1 lies outside the DEM",
    ),
    "a path over unknown ground": (
        {**ONE, "points_m": [[UNKNOWN_GROUND["east_m"], UNKNOWN_GROUND["north_m"], 900.0]]},
        "bubble",
        "unknown ground",
    ),
    "a building file that holds nothing": (
        {**ONE, "buildings": {"name": "town.stl", "base64": encoded(b"solid nothing")}},
        "mesh",
        "town.stl",
    ),
    "a building where the DEM is not": (
        {**ONE, "buildings": {"name": "town.obj", "base64": encoded(TENT)}},
        "mesh",
        "no known ground below",
    ),
    "a building file of an unknown kind": (
        {**ONE, "buildings": {"name": "town.dxf", "base64": encoded(TENT)}},
        "validation",
        "buildings.name",
    ),
    "a point inside a building": (
        {**ONE, "buildings": {**TOWER, "origin_east_m": MIDDLE[0], "origin_north_m": MIDDLE[1] - 5.0}},
        "bubble",
        "Point 0 lies inside a building",
    ),
    "an anchor under the ground": (
        {"points_m": [HIGH], "anchors": [{**ANCHOR, "above_ground_m": -9.0}]},
        "validation",
        "above_ground_m",
    ),
    "more points than the limit": ({**ONE, "points_m": [HIGH] * 100_001}, "limit", "SIGHTLINE_MAX_PATH_POINTS"),
    "more anchors than the limit": (
        {"points_m": [HIGH], "anchors": [{**ANCHOR, "id": f"A{n}"} for n in range(65)]},
        "limit",
        "SIGHTLINE_MAX_ANCHORS",
    ),
    "more epochs than can be predicted": (
        {**TWO, "times_s": [0.0, 1e9], "ranging_interval_s": 0.001},
        "bubble",
        "intervals",
    ),
}


def asked(server: Server, **request: Any) -> Any:
    return server.client.post("/safety-bubbles", json=request, headers={"Prefer": "wait=60"}, timeout=120.0)


@pytest.mark.parametrize("what", BAD)
def test_bubbles_are_refused_with(server: Server, jacksboro: dict[str, Any], what: str) -> None:
    request, kind, word = BAD[what]
    assert_problem(asked(server, dem_id=jacksboro["id"], **request), 422, kind, word)


def test_a_long_outage_makes_the_bubble_huge_and_nothing_else(server: Server, jacksboro: dict[str, Any]) -> None:
    made = asked(server, dem_id=jacksboro["id"], **TWO | {"times_s": [0.0, 1e7]})
    assert made.status_code == 201, made.text
    first, last = made.json()["points"]
    assert first["radius_m"] < 50.0 < 1000.0 < last["radius_m"] < 1e7
    assert last["verdict"] == "violated"


def test_pseudoranges_to_satellites_over_the_hills(server: Server, jacksboro: dict[str, Any]) -> None:
    sky = {"almanac": almanac(), "time": TIME, "reference_date": REFERENCE_DATE}
    path_m = [[MIDDLE[0] + 30.0 * step, MIDDLE[1], 1200.0] for step in range(60)]
    made = asked(
        server,
        dem_id=jacksboro["id"],
        points_m=path_m,
        satellites=sky,
        kind="pseudorange",
        dop_scaled=True,
        unknown="open",
        speed_m_per_s=10.0,
    )
    assert made.status_code == 201, made.text
    told = made.json()
    names = {satellite["id"] for satellite in told["result"]["satellites"]}
    assert len(names) >= 4
    assert 4 <= len(told["points"][0]["in_sight"]) == len(set(told["points"][0]["in_sight"]) & names)
    assert told["points"][-1]["radius_m"] < told["points"][0]["radius_m"]
    assert "almanac" not in told["request"]["satellites"]


def test_an_anchor_that_is_unsure_of_its_own_place_along_the_line_to_it_tells_less(
    server: Server, jacksboro: dict[str, Any]
) -> None:
    radius_m = {}
    for name, (ee_m2, nn_m2) in {"sure": (0.0, 0.0), "across": (0.0, 400.0), "along": (400.0, 0.0)}.items():
        pose = {"pose_covariance_m2": [[ee_m2, 0.0, 0.0], [0.0, nn_m2, 0.0], [0.0, 0.0, 0.0]]}
        at_its_height = {key: value for key, value in ANCHOR.items() if key != "above_ground_m"} | {
            "altitude_m": 1200.0
        }
        made = asked(server, dem_id=jacksboro["id"], points_m=[HIGH], anchors=[at_its_height | pose])
        assert made.status_code == 201, made.text
        radius_m[name] = made.json()["points"][0]["radius_m"]
    assert radius_m["sure"] == pytest.approx(radius_m["across"], abs=1e-5)
    assert radius_m["along"] == pytest.approx(3.0 * (200.0 + 1.0 / (1.0 / 100.0 + 1.0 / 400.25)) ** 0.5, abs=1e-4)


def test_a_tower_that_came_along_hides_an_anchor_and_is_what_is_nearest(
    server: Server, jacksboro: dict[str, Any]
) -> None:
    beside = {**TOWER, "origin_east_m": MIDDLE[0] + 60.0, "origin_north_m": MIDDLE[1]}
    made = asked(server, dem_id=jacksboro["id"], **ONE, buildings=beside)
    assert made.status_code == 201, made.text
    told = made.json()
    point = told["points"][0]
    assert (point["nearest"], point["in_sight"]) == ("building", [])
    assert point["push"][0] < -0.9
    assert told["result"]["buildings"]["triangles"] == 4
    assert "base64" not in told["request"]["buildings"]
    without = asked(server, dem_id=jacksboro["id"], **ONE).json()["points"][0]
    assert (without["nearest"], without["in_sight"]) == ("ground", ["D1"])
