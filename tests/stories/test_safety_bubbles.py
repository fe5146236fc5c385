"""Safety bubbles over real HTTP: a path before it is driven, and a history of poses, judged as the packages judge."""

from __future__ import annotations

import csv
import io
from typing import Any

import numpy as np
import pytest

import navigation
import visibility
from dem_samples import sample_path
from terrain import ElevationGrid, height_at, nearest_surface, read_dem, to_lon_lat
from tests.service.running import Server

SIGMA_M, SPEED_M_PER_S, EPSILON, DEM_SIGMA_M = 0.5, 8.0, 3.0, 1.5
DRONES_ABOVE_GROUND_M = 400.0
PLACES = {"D1": (0.3, 0.3), "D2": (0.7, 0.35), "D3": (0.5, 0.75), "D4": (0.45, 0.5)}
NUMBERS = ("radius_m", "clearance_m", "margin_m", "distance_m", "time_s")


@pytest.fixture(scope="module")
def grid() -> ElevationGrid:
    return read_dem(sample_path("jacksboro"))


def place(grid: ElevationGrid, x: float, y: float) -> tuple[float, float]:
    west_m, south_m, east_m, north_m = grid.bounds_m
    return west_m + x * (east_m - west_m), south_m + y * (north_m - south_m)


@pytest.fixture(scope="module")
def path_m(grid: ElevationGrid) -> Any:
    """400 points across the hills, 60 m above the ground."""
    share = np.linspace(0.0, 1.0, 400)[:, None]
    across = np.array(place(grid, 0.5, 0.3)) * (1.0 - share) + np.array(place(grid, 0.5, 0.7)) * share
    return np.column_stack([across, height_at(grid, across[:, 0], across[:, 1]) + 60.0])


@pytest.fixture(scope="module")
def asked(server: Server, grid: ElevationGrid, path_m: Any) -> dict[str, Any]:
    anchors = [
        {
            "id": name,
            **dict(zip(("east_m", "north_m"), place(grid, *at), strict=True)),
            "above_ground_m": DRONES_ABOVE_GROUND_M,
            "ranging_sigma_m": SIGMA_M,
        }
        for name, at in PLACES.items()
    ]
    return {
        "dem_id": server.sample("jacksboro")["id"],
        "anchors": anchors,
        "points_m": path_m.tolist(),
        "speed_m_per_s": SPEED_M_PER_S,
        "epsilon": EPSILON,
        "dem_sigma_m": DEM_SIGMA_M,
    }


@pytest.fixture(scope="module")
def told(server: Server, asked: dict[str, Any]) -> dict[str, Any]:
    answer = server.client.post("/safety-bubbles", json=asked, headers={"Prefer": "wait=60"})
    assert answer.status_code == 201, answer.text
    return dict(answer.json())


def test_each_point_gets_what_the_python_packages_say(told: dict[str, Any], grid: ElevationGrid, path_m: Any) -> None:
    drones = [
        visibility.anchor_above_ground(grid, name, *place(grid, *at), above_ground_m=DRONES_ABOVE_GROUND_M)
        for name, at in PLACES.items()
    ]
    sets = visibility.visible_sets(visibility.min_visible_altitude(grid, drones), path_m)
    anchors_m = [(drone.east_m, drone.north_m, drone.altitude_m) for drone in drones]
    steps_m = np.linalg.norm(np.diff(path_m, axis=0), axis=1)
    way_m = np.concatenate([[0.0], np.cumsum(steps_m)])
    bubble = navigation.predict_bubble(
        path_m, way_m / SPEED_M_PER_S, anchors_m, sets.visible(), SIGMA_M, epsilon=EPSILON, dem_sigma_m=DEM_SIGMA_M
    )
    clearance_m = nearest_surface(grid, path_m).distance_m
    points = told["points"]
    expected = (bubble.radius_m, clearance_m, clearance_m - bubble.radius_m, way_m, way_m / SPEED_M_PER_S)
    for name, values in zip(NUMBERS, expected, strict=True):
        np.testing.assert_allclose([point[name] for point in points], values, atol=1e-5, err_msg=name)
    for point, visible in zip(points, sets.visible(), strict=True):
        assert point["in_sight"] == [drone.id for drone, seen in zip(drones, visible, strict=True) if seen]
    assert {len(point["in_sight"]) for point in points} == {0, 1, 2, 3, 4}


def test_the_first_violation_is_named_and_its_push_ends_it(told: dict[str, Any], grid: ElevationGrid) -> None:
    points, result = told["points"], told["result"]
    assert [point["verdict"] for point in points] == ["ok" if p["margin_m"] >= 0.0 else "violated" for p in points]
    first = result["first_violation"]
    number = next(n for n, point in enumerate(points) if point["verdict"] == "violated")
    assert number > 0
    assert first["point"] == number
    assert first["margin_m"] == pytest.approx(points[number]["margin_m"], abs=1e-5)
    assert first["in_sight"] == points[number]["in_sight"]
    assert result["violated"] + result["ok"] == result["points"] == len(points)
    assert result["violated"] == sum(point["verdict"] == "violated" for point in points)
    assert result["least_margin_m"] == pytest.approx(min(point["margin_m"] for point in points), abs=1e-5)
    at = points[number]
    pushed = np.array([at["east_m"], at["north_m"], at["altitude_m"]]) + np.array(at["push"]) * at["push_m"]
    before_m, after_m = at["clearance_m"], float(nearest_surface(grid, pushed).distance_m[0])
    assert before_m < after_m <= at["radius_m"] + 1e-3


def test_a_bubble_grows_while_fewer_anchors_are_in_sight_than_fix_it(told: dict[str, Any]) -> None:
    sight = np.array([len(point["in_sight"]) for point in told["points"]])
    radius_m = np.array([point["radius_m"] for point in told["points"]])
    settled = np.arange(len(sight)) > 20
    assert np.median(radius_m[settled & (sight <= 1)]) > 3.0 * np.median(radius_m[settled & (sight == 4)])


def test_files_say_the_same(server: Server, told: dict[str, Any], grid: ElevationGrid) -> None:
    files = {path.rsplit("/", 1)[1]: server.client.get(path).raise_for_status() for path in told["files"]}
    points = told["points"]
    assert files["points.json"].json() == points
    rows = list(csv.DictReader(io.StringIO(files["points.csv"].text)))
    assert [float(row["margin_m"]) for row in rows] == [point["margin_m"] for point in points]
    assert [row["verdict"] for row in rows] == [point["verdict"] for point in points]
    assert [row["in_sight"].split() for row in rows] == [point["in_sight"] for point in points]
    features = files["points.geojson"].json()["features"]
    lon_lat = np.array([feature["geometry"]["coordinates"][:2] for feature in features])
    expected = np.column_stack(to_lon_lat(grid, *np.array([(p["east_m"], p["north_m"]) for p in points]).T))
    np.testing.assert_allclose(lon_lat, expected, atol=1e-7)
    assert features[7]["properties"]["radius_m"] == points[7]["radius_m"]
    with np.load(io.BytesIO(files["points.npz"].content)) as arrays:
        trace_m2 = np.trace(arrays["covariance_m2"], axis1=1, axis2=2)
        np.testing.assert_allclose(EPSILON * np.sqrt(trace_m2) + DEM_SIGMA_M, arrays["radius_m"])
        assert arrays["visible"].shape == (len(points), len(PLACES))


def test_a_history_of_poses_is_judged_by_its_own_covariances(server: Server, grid: ElevationGrid) -> None:
    east_m, north_m = place(grid, 0.4, 0.45)
    ground_m = float(height_at(grid, east_m, north_m))
    history = {
        "dem_id": server.sample("jacksboro")["id"],
        "points_m": [[east_m, north_m, ground_m + above_m] for above_m in (90.0, 90.0, -4.0)],
        "times_s": [0.0, 2.5, 2.5],
        "covariances_m2": [[1.0, 0.2, 0.0, 1.0, 0.1, 2.0], [2500.0, 0.0, 0.0, 900.0, 0.0, 81.0], [1.0, 0, 0, 1, 0, 1]],
        "under_ground": "violated",
    }
    answer = server.client.post("/safety-bubbles", json=history, headers={"Prefer": "wait=60"})
    assert answer.status_code == 201, answer.text
    told = answer.json()
    assert [point["radius_m"] for point in told["points"]] == pytest.approx(
        [3.0 * 4.0**0.5, 3.0 * 3481.0**0.5, 3.0 * 3.0**0.5], abs=1e-6
    )
    assert [point["verdict"] for point in told["points"]] == ["ok", "violated", "violated"]
    assert told["points"][2]["push"][2] > 0.0
    assert told["points"][2]["clearance_m"] < 0.0
    assert told["result"]["first_violation"]["point"] == 1
    assert {point["in_sight"] for point in told["points"]} == {None}
    assert told["result"]["curvature"] is None


def test_100_000_points_at_once(server: Server, asked: dict[str, Any], path_m: Any) -> None:
    share = np.linspace(0.0, 399.0, 100_000)
    many_m = np.column_stack([np.interp(share, np.arange(400), path_m[:, axis]) for axis in range(3)])
    state = server.client.post(
        "/safety-bubbles", json={**asked, "points_m": many_m.round(3).tolist(), "ranging_interval_s": 1.0}
    )
    assert state.status_code == 202, state.text
    told = server.until_over(state.headers["Location"])
    assert told["status"] == "succeeded", told["problem"]
    assert len(told["points"]) == told["result"]["points"] == 100_000
