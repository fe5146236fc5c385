"""The main job over real HTTP: a real DEM and four drones in, a map and its files out."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
import rasterio

import visibility
from dem_samples import sample_path
from terrain import ElevationGrid, read_dem
from tests.service.running import Server

DRONES = [
    {"id": "D1", "lon_deg": -84.2392, "lat_deg": 36.3300, "above_ground_m": 150.0},
    {"id": "D2", "lon_deg": -84.1443, "lat_deg": 36.3836, "above_ground_m": 150.0},
    {"id": "D3", "lon_deg": -84.1107, "lat_deg": 36.2963, "above_ground_m": 150.0},
    {"id": "D4", "lon_deg": -84.1970, "lat_deg": 36.2605, "altitude_m": 900.0},
]
RECEIVER_M = 1.5


@pytest.fixture(scope="module")
def grid() -> ElevationGrid:
    return read_dem(sample_path("jacksboro"))


@pytest.fixture(scope="module")
def finished(server: Server) -> dict[str, Any]:
    dem = server.upload(sample_path("jacksboro"))
    answer = server.client.post(
        "/visibility-maps",
        json={"dem_id": dem["id"], "anchors": DRONES, "receiver_above_ground_m": RECEIVER_M},
        headers={"Prefer": "wait=60"},
    )
    assert answer.status_code == 201, answer.text
    assert answer.headers["Preference-Applied"] == "wait=60"
    assert answer.headers["Location"] == f"/visibility-maps/{answer.json()['id']}"
    return dict(answer.json())


@pytest.fixture(scope="module")
def computed_here(grid: ElevationGrid, finished: dict[str, Any]) -> visibility.MinimumVisibleAltitude:
    """The same by the Python packages, from the positions that the service says it used."""
    anchors = [
        visibility.Anchor(a["id"], a["east_m"], a["north_m"], a["altitude_m"]) for a in finished["result"]["anchors"]
    ]
    return visibility.min_visible_altitude(grid, anchors)


def test_the_uploaded_dem_is_described_with_its_conversions(server: Server, grid: ElevationGrid) -> None:
    dem = server.upload(sample_path("jacksboro"))
    looked_up = server.client.get(dem["links"]["self"]).json()
    assert looked_up == dem
    assert (dem["rows"], dem["cols"]) == grid.shape
    assert dem["sha256"] == grid.digest
    assert dem["crs"] == "EPSG:32616"
    assert dem["unknown_posts"] == grid.unknown_posts
    assert any("Warped" in sentence for sentence in dem["conversions"])


def test_the_result_says_how_it_was_made_and_how_far_to_trust_it(finished: dict[str, Any]) -> None:
    result = finished["result"]
    assert finished["status"] == "succeeded"
    assert finished["progress"] == 1.0
    assert finished["attempts"] == 1
    assert result["mode"] == "fast"
    assert "k = 1.333" in result["curvature"]
    assert result["error_statement"]
    assert [anchor["id"] for anchor in result["anchors"]] == ["D1", "D2", "D3", "D4"]
    assert sum(entry["share"] for entry in result["count_histogram"]) == pytest.approx(1.0)


def test_the_geotiffs_say_what_the_python_packages_say(
    server: Server, grid: ElevationGrid, finished: dict[str, Any], computed_here: visibility.MinimumVisibleAltitude
) -> None:
    visible = computed_here.visible(above_ground_m=RECEIVER_M)
    for name, expected in (("visible.tif", visible), ("min_visible_altitude.tif", computed_here.altitude_m)):
        bands, profile = downloaded_raster(server, finished, name)
        np.testing.assert_array_equal(bands, expected)
        assert profile["crs"] == grid.crs
        west_m, north_m = grid.origin_east_m - grid.cell_east_m / 2, grid.origin_north_m + grid.cell_north_m / 2
        assert profile["transform"].c == pytest.approx(west_m, abs=1e-6)
        assert profile["transform"].f == pytest.approx(north_m, abs=1e-6)
    count, _ = downloaded_raster(server, finished, "count.tif")
    known = ~(visible == visibility.UNKNOWN).all(axis=0)
    np.testing.assert_array_equal(count[0][known], (visible == visibility.VISIBLE).sum(axis=0)[known])


def test_the_arrays_are_those_of_the_python_packages(
    server: Server, finished: dict[str, Any], computed_here: visibility.MinimumVisibleAltitude
) -> None:
    content = server.client.get(f"{finished['links']['self']}/layers/arrays.npz").raise_for_status().content
    with np.load(io.BytesIO(content)) as arrays:
        np.testing.assert_array_equal(arrays["min_visible_altitude_m"], computed_here.altitude_m)


def test_the_same_file_uploaded_again_is_the_same_dem(server: Server) -> None:
    path = sample_path("valley")
    as_form = server.client.post("/dems", files={"file": (path.name, path.read_bytes())})
    as_body = server.client.post("/dems", params={"filename": path.name}, content=path.read_bytes())
    assert (as_form.status_code, as_body.status_code) == (201, 200)
    assert as_form.json() == as_body.json()


def test_finished_maps_outlive_their_dem(server: Server) -> None:
    dem = server.sample("crater")
    bounds = dem["bounds_of_posts_m"]
    anchor = {"id": "A", "east_m": bounds["west"], "north_m": bounds["north"], "altitude_m": dem["highest_m"] + 50.0}
    request = {"dem_id": dem["id"], "anchors": [anchor]}
    made = server.client.post("/visibility-maps", json=request, headers={"Prefer": "wait=60"}).json()
    assert server.client.delete(f"/dems/{dem['id']}").status_code == 204
    assert server.client.get(f"/dems/{dem['id']}").status_code == 404
    assert server.client.get(made["layers"][0]["href"]).status_code == 200
    assert server.client.delete(made["links"]["self"]).status_code == 204


def downloaded_raster(server: Server, finished: dict[str, Any], name: str) -> tuple[Any, dict[str, Any]]:
    href = next(layer["href"] for layer in finished["layers"] if layer["name"] == name)
    with rasterio.MemoryFile(server.client.get(href).content) as file, file.open() as raster:
        return raster.read(), raster.profile
