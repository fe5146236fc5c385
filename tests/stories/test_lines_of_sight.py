"""Lines of sight over real HTTP: what the answer says is what the Python packages say, up to 100 000 at once."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest

import visibility
from dem_samples import sample_path
from terrain import ElevationGrid, height_at, read_dem, to_grid_frame
from tests.service.running import Server

MANY = 100_000
WORDS = {int(visibility.VISIBLE): "clear", int(visibility.HIDDEN): "blocked", int(visibility.UNKNOWN): "unknown"}


@pytest.fixture(scope="module")
def grid() -> ElevationGrid:
    return read_dem(sample_path("jacksboro"))


@pytest.fixture(scope="module")
def dem_id(server: Server) -> str:
    return str(server.sample("jacksboro")["id"])


def random_points(grid: ElevationGrid, number: int, seed: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """(n, 3) east, north and altitude over the grid, from below the valleys to above the summits."""
    west_m, south_m, east_m, north_m = grid.bounds_m
    generator = np.random.default_rng(seed)
    return np.column_stack(
        [
            generator.uniform(west_m, east_m, number),
            generator.uniform(south_m, north_m, number),
            generator.uniform(300.0, 1200.0, number),
        ]
    )


def test_each_pair_gets_what_the_python_packages_say(server: Server, grid: ElevationGrid, dem_id: str) -> None:
    from_m, to_m = random_points(grid, 300, 1), random_points(grid, 300, 2)
    here = visibility.lines_of_sight(grid, from_m, to_m, wavelength_m=0.125, dem_sigma_m=5.0, excess_path=True)
    answer = server.client.post(
        "/lines-of-sight",
        json={
            "dem_id": dem_id,
            "from_points_m": from_m.tolist(),
            "to_points_m": to_m.tolist(),
            "wavelength_m": 0.125,
            "dem_sigma_m": 5.0,
        },
        headers={"Prefer": "wait=60"},
    )
    assert answer.status_code == 201, answer.text
    lines = answer.json()["lines"]
    assert [line["verdict"] for line in lines] == [WORDS[int(verdict)] for verdict in here.verdict]
    assert set(WORDS.values()) == {line["verdict"] for line in lines}
    for name in ("clearance_m", "distance_m", "fresnel_clearance", "excess_path_m", "probability_clear"):
        expected = getattr(here, name)
        told = np.array([np.nan if line[name] is None else line[name] for line in lines])
        np.testing.assert_allclose(told, np.where(np.isfinite(expected), expected, np.nan), atol=1e-6)
    for number, line in enumerate(lines):
        assert (line["blocking_point"] is None) == (line["verdict"] != "blocked")
        if line["blocking_point"] is not None:
            point = [line["blocking_point"][name] for name in ("east_m", "north_m", "altitude_m")]
            np.testing.assert_allclose(point, here.blocking_point_m[number], atol=1e-6)
    counted = answer.json()["result"]
    assert {word: counted[word] for word in WORDS.values()} == {
        word: int((here.verdict == value).sum()) for value, word in WORDS.items()
    }


def test_points_may_be_given_in_degrees_and_above_ground(server: Server, grid: ElevationGrid, dem_id: str) -> None:
    pair = {
        "from": {"lon_deg": -84.1970, "lat_deg": 36.3300, "above_ground_m": 150.0},
        "to": {"lon_deg": -84.1443, "lat_deg": 36.3836, "above_ground_m": 1.5},
    }
    request = {"dem_id": dem_id, "pairs": [pair], "frequency_hz": 2.4e9}
    answer = server.client.post("/lines-of-sight", json=request, headers={"Prefer": "wait=60"})
    assert answer.status_code == 201, answer.text
    ends = []
    for end in (pair["from"], pair["to"]):
        east_m, north_m = to_grid_frame(grid, end["lon_deg"], end["lat_deg"])
        ends.append((east_m, north_m, float(height_at(grid, east_m, north_m)) + end["above_ground_m"]))
    here = visibility.line_of_sight(grid, *ends, wavelength_m=299_792_458.0 / 2.4e9)
    line = answer.json()["lines"][0]
    assert line["verdict"] == here.verdict
    assert line["clearance_m"] == pytest.approx(here.clearance_m, abs=1e-6)
    assert line["fresnel_clearance"] == pytest.approx(here.fresnel_clearance, abs=1e-6)


def test_100_000_pairs_at_once(server: Server, grid: ElevationGrid, dem_id: str) -> None:
    from_m, to_m = random_points(grid, MANY, 3), random_points(grid, MANY, 4)
    request = {"dem_id": dem_id, "from_points_m": from_m.round(2).tolist(), "to_points_m": to_m.round(2).tolist()}
    answer = server.client.post("/lines-of-sight", json=request)
    assert answer.status_code == 202, answer.text
    assert answer.json()["lines"] is None
    state = server.until_over(answer.headers["Location"])
    assert state["status"] == "succeeded"
    assert len(state["lines"]) == state["result"]["lines"] == MANY
    arrays = server.client.get(next(path for path in state["files"] if path.endswith(".npz")))
    here = visibility.lines_of_sight(grid, from_m.round(2), to_m.round(2))
    with np.load(io.BytesIO(arrays.content)) as told:
        np.testing.assert_array_equal(told["verdict"], here.verdict)
        np.testing.assert_array_equal(told["clearance_m"], here.clearance_m)


def test_one_pair_too_many_is_refused(server: Server, dem_id: str) -> None:
    points = [[0.0, 0.0, 0.0]] * (MANY + 1)
    answer = server.client.post(
        "/lines-of-sight", json={"dem_id": dem_id, "from_points_m": points, "to_points_m": points}
    )
    assert answer.status_code == 422
    assert "100,001 pairs" in answer.json()["detail"]
