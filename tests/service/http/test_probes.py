"""Places and profiles answered without a job: equal to the jobs' answers, in milliseconds, or one sentence."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from terrain import ElevationGrid, write_npz
from tests.service.running import Server
from visibility import dop
from visibility.dilution import position_error

ANCHORS = [
    {
        "id": f"D{n}",
        "lon_deg": -84.40 + 0.075 * (n % 4),
        "lat_deg": 36.18 + 0.06 * (n // 4),
        "above_ground_m": 60.0 + 5 * n,
    }
    for n in range(16)
]
END = {"lon_deg": -84.36, "lat_deg": 36.4, "above_ground_m": 2.0}
ELSEWHERE = {"lon_deg": 9.0, "lat_deg": 9.0, "above_ground_m": 1.0}
PLACES = [{"lon_deg": -84.25 + 0.012 * n, "lat_deg": 36.25 + 0.007 * n} for n in range(5)]


def level(rows: int, cols: int) -> ElevationGrid:
    return ElevationGrid(np.zeros((rows, cols), np.float32), 10.0, 10.0)


def probe(server: Server, dem: dict[str, Any], **body: Any) -> dict[str, Any]:
    answer = server.client.post("/probe", json={"dem_id": dem["id"], **body})
    assert answer.status_code == 200, answer.text
    return dict(answer.json())


def test_a_probe_sees_what_lines_of_sight_see(server: Server, jacksboro: dict[str, Any]) -> None:
    points = probe(server, jacksboro, points=PLACES, anchors=ANCHORS, receiver_above_ground_m=2.0)["points"]
    ends = [{"lon_deg": p["lon_deg"], "lat_deg": p["lat_deg"], "above_ground_m": 2.0} for p in PLACES]
    fields = ("lon_deg", "lat_deg", "above_ground_m")
    pairs = [{"from": {key: a[key] for key in fields}, "to": end} for end in ends for a in ANCHORS]
    asked = server.client.post(
        "/lines-of-sight", json={"dem_id": jacksboro["id"], "pairs": pairs}, headers={"Prefer": "wait=60"}
    )
    assert asked.status_code == 201, asked.text
    lines = iter(asked.json()["lines"])
    words = {"clear": "visible", "blocked": "hidden", "unknown": "unknown"}
    verdicts = set()
    for point in points:
        for seen in point["anchors"]:
            line = next(lines)
            assert seen["verdict"] == words[line["verdict"]]
            assert seen["clearance_m"] == pytest.approx(line["clearance_m"], abs=1e-5)
            assert (seen["blocking_point"] is None) == (line["blocking_point"] is None)
            verdicts.add(seen["verdict"])
        assert point["visible_anchors"] == sum(a["verdict"] == "visible" for a in point["anchors"])
    assert {"visible", "hidden"} <= verdicts


def test_dilution_and_error_are_those_of_the_anchors_in_sight(tmp_path: Path, server: Server) -> None:
    write_npz(level(60, 80), tmp_path / "plane.npz")
    dem = server.upload(tmp_path / "plane.npz")
    west, north = dem["bounds_of_posts_m"]["west"], dem["bounds_of_posts_m"]["north"]
    places = [(100.0, 100.0, 300.0), (600.0, 150.0, 350.0), (200.0, 500.0, 400.0), (650.0, 480.0, 280.0)]
    anchors = [
        {"id": str(n), "east_m": west + e, "north_m": north - s, "altitude_m": z, "ranging_sigma_m": 0.2 + 0.1 * n,
         "pose_sigma_m": 0.5}
        for n, (e, s, z) in enumerate(places)
    ]  # fmt: skip
    anchors[3]["max_range_m"] = 50.0
    body = {"points": [{"east_m": west + 333.0, "north_m": north - 271.0}], "receiver_altitude_m": 250.0}
    (point,) = probe(server, dem, anchors=anchors, **body)["points"]
    assert [a["verdict"] for a in point["anchors"]] == ["visible"] * 3 + ["out_of_reach"]
    at = np.array([(west + e, north - s, z) for e, s, z in places])
    receiver, seen = (west + 333.0, north - 271.0, 250.0), [True, True, True, False]
    expected = dop(at, receiver, visible=seen)
    for name in ("gdop", "pdop", "hdop", "vdop"):
        assert point["dilution"][name] == pytest.approx(float(getattr(expected, name)))
    error = position_error(at, receiver, [0.2, 0.3, 0.4, 0.5], pose_sigma_m=0.5, visible=seen)
    assert point["position_sigma_m"] == pytest.approx(float(error.position_sigma_m))
    assert point["dilution"]["reason"] == "ok"


def test_the_slope_of_a_plane_is_its_own(tmp_path: Path, server: Server) -> None:
    col, row = np.meshgrid(np.arange(50), np.arange(40))
    write_npz(replace(level(40, 50), heights_m=(3.0 * col - 4.0 * row).astype("f4")), tmp_path / "slope.npz")
    dem = server.upload(tmp_path / "slope.npz")
    bounds = dem["bounds_of_posts_m"]
    middle = {"east_m": (bounds["west"] + bounds["east"]) / 2 + 3.0, "north_m": (bounds["south"] + bounds["north"]) / 2}
    inside, outside = probe(server, dem, points=[middle, {"east_m": -1e5, "north_m": 0.0}])["points"]
    assert inside["slope_deg"] == pytest.approx(math.degrees(math.atan(0.5)), abs=1e-3)
    assert inside["downhill_deg"] == pytest.approx(math.degrees(math.atan2(-0.3, -0.4)) % 360.0, abs=1e-2)
    assert inside["receiver_altitude_m"] == pytest.approx(inside["ground_m"] + 1.5)
    assert (inside["dilution"], inside["anchors"]) == (None, [])
    assert (outside["ground_m"], outside["slope_deg"], outside["receiver_altitude_m"]) == (None, None, None)


def test_a_profile_holds_ground_line_zone_and_blocking_point(server: Server, jacksboro: dict[str, Any]) -> None:
    pair = {
        "from": {**PLACES[0], "above_ground_m": 2.0},
        "to": {"lon_deg": -84.36, "lat_deg": 36.4, "above_ground_m": 2.0},
    }
    body = {"dem_id": jacksboro["id"], "pairs": [pair, {"from": pair["to"], "to": pair["from"]}], "wavelength_m": 0.125}
    answer = server.client.post("/profiles", json=body)
    assert answer.status_code == 200, answer.text
    there, back = answer.json()["profiles"]
    assert there["verdict"] == back["verdict"] == "blocked"
    distance, ground, line = (np.array(there[name], float) for name in ("distance_m", "ground_m", "line_m"))
    assert len(distance) == len(ground) == len(line) == len(there["fresnel_radius_m"])
    assert (np.diff(distance) > 0.0).all()
    assert np.nanmin(line - ground) == pytest.approx(there["clearance_m"], abs=2e-3)
    assert there["clearance_m"] == pytest.approx(back["clearance_m"], abs=1e-3)
    worst = int(np.nanargmin(line - ground))
    assert distance[worst] == pytest.approx(there["blocking_distance_m"], abs=1e-2)
    whole = distance[-1]
    middle = int(np.argmin(np.abs(distance - whole / 2)))
    assert there["fresnel_radius_m"][middle] == pytest.approx(math.sqrt(0.125 * whole) / 2, rel=1e-3)
    assert there["fresnel_radius_m"][0] == there["fresnel_radius_m"][-1] == 0.0
    thin = server.client.post("/profiles", json={**body, "max_places": 9}).json()["profiles"][0]
    assert len(thin["distance_m"]) == 9
    least = np.nanmin(np.array(thin["line_m"], float) - np.array(thin["ground_m"], float))
    assert least == pytest.approx(there["clearance_m"], abs=2e-3), "the place that blocks stays"


def test_sixteen_anchors_are_answered_again_and_again_and_nothing_is_kept(
    server: Server, jacksboro: dict[str, Any]
) -> None:
    before = server.client.get("/lines-of-sight").json()["total"]
    body = {"dem_id": jacksboro["id"], "points": PLACES[:1], "anchors": ANCHORS}
    for _ in range(60):  # how quickly is measured by ``python -m benchmarks --only ground``
        assert server.client.post("/probe", json=body).status_code == 200
    assert server.client.get("/lines-of-sight").json()["total"] == before


@pytest.mark.parametrize(
    ("path", "body", "status", "sentence"),
    [
        ("/probe", {"points": []}, 422, "at least 1 item"),
        ("/probe", {"points": PLACES[:1] * 101}, 422, "at most 100 items"),
        ("/probe", {"points": [{"lon_deg": 1.0}]}, 422, "exactly one of the pairs"),
        ("/probe", {"points": PLACES, "anchors": [ANCHORS[0], ANCHORS[0]]}, 422, "must be unique"),
        ("/probe", {"points": PLACES, "receiver_altitude_m": 1.0, "receiver_above_ground_m": 1.0}, 422, "only one"),
        ("/probe", {"points": PLACES, "anchors": [{**ANCHORS[0], "lon_deg": 9.0}]}, 422, "outside the DEM"),
        ("/profiles", {"pairs": []}, 422, "at least 1 item"),
        ("/profiles", {"pairs": [{"from": {**PLACES[0], "above_ground_m": 1.0}, "to": ELSEWHERE}]}, 422,
         "pairs[0].to lies outside the DEM"),
        ("/probe", {"dem_id": "0" * 32, "points": PLACES}, 404, "There is no DEM"),
    ],
)  # fmt: skip
def test_what_cannot_be_answered_is_one_sentence(
    server: Server, jacksboro: dict[str, Any], path: str, body: dict[str, Any], status: int, sentence: str
) -> None:
    answer = server.client.post(path, json={"dem_id": jacksboro["id"], **body})
    assert answer.status_code == status, answer.text
    assert sentence in answer.json()["detail"]
