"""DEMs made from the ground library over HTTP, and what is refused."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio

from service.ground.coverage import LIBRARY
from terrain import GroundLibrary, index_ground
from terrain.tiles.library import edited
from tests.service.running import Server
from tests.terrain.files import write_tif
from tests.terrain.tiles.cutting import cut_tif, rough

METRES = rasterio.Affine(30, 0, 700_000, 0, -30, 5_100_000)
HEIGHTS = rough(120, 150)
MIDDLE = {"lon_deg": 11.62, "lat_deg": 46.0, "radius_m": 800.0}


@pytest.fixture
def tiles(server: Server, tmp_path: Path) -> Iterator[Path]:
    """Nine tiles in the library of the service, which is emptied again."""
    folder = tmp_path / "tiles"
    cut_tif(folder, HEIGHTS, METRES, shared=True)
    with edited(server.folder / LIBRARY) as editing:
        editing.library, _ = index_ground(GroundLibrary(), [folder])
    yield folder
    (server.folder / LIBRARY).unlink()


def ask(server: Server, **body: Any) -> Any:
    return server.client.post("/dems", json=body)


def test_an_area_becomes_a_dem_and_the_same_again_is_the_same(server: Server, tiles: Path) -> None:
    answer = ask(server, area=MIDDLE)
    assert answer.status_code == 201, answer.text
    dem = answer.json()
    assert answer.headers["Location"] == f"/dems/{dem['id']}"
    assert (dem["driver"], dem["crs"], dem["cell_east_m"]) == ("mosaic", "EPSG:32632", 30.0)
    assert dem["name"].startswith("mosaic of ")
    assert dem["unknown_posts"] == 0
    bounds = dem["bounds_of_posts_m"]
    assert bounds["east"] - bounds["west"] == pytest.approx(1600.0, abs=61.0)
    again = ask(server, area=MIDDLE)
    assert (again.status_code, again.json()["id"]) == (200, dem["id"])
    anchors = [{"id": "A", **{k: MIDDLE[k] for k in ("lon_deg", "lat_deg")}, "above_ground_m": 50.0}]
    seen = server.client.post(
        "/visibility-maps", json={"dem_id": dem["id"], "anchors": anchors}, headers={"Prefer": "wait=60"}
    )
    assert seen.status_code == 201, seen.text


def test_a_margin_is_ground_too(server: Server, tiles: Path) -> None:
    narrow, wide = ask(server, area=MIDDLE).json(), ask(server, area=MIDDLE, margin_m=300.0).json()
    gained = wide["bounds_of_posts_m"]["east"] - narrow["bounds_of_posts_m"]["east"]
    assert gained == pytest.approx(300.0, abs=31.0)


@pytest.mark.parametrize(
    "area",
    [
        {"west_deg": 11.61, "south_deg": 45.99, "east_deg": 11.63, "north_deg": 46.0},
        {"west_m": 701_000.0, "south_m": 5_097_500.0, "east_m": 702_000.0, "north_m": 5_098_500.0},
        {"ring": [{"lon_deg": lon, "lat_deg": lat} for lon, lat in ((11.61, 45.99), (11.63, 45.99), (11.62, 46.01))]},
        {"type": "Polygon", "coordinates": [[[11.61, 45.99], [11.63, 45.99], [11.62, 46.01], [11.61, 45.99]]]},
    ],
    ids=["degrees", "metres", "ring", "GeoJSON"],
)
def test_an_area_may_be_written_in_many_ways(server: Server, tiles: Path, area: dict[str, Any]) -> None:
    answer = ask(server, area=area, **({"crs": "EPSG:32632"} if "west_m" in area else {}))
    assert answer.status_code == 201, answer.text
    assert answer.json()["unknown_posts"] == 0


def test_the_coverage_is_geojson_without_paths(server: Server, tiles: Path) -> None:
    answer = server.client.get("/ground")
    coverage = answer.json()
    assert coverage["type"] == "FeatureCollection"
    assert len(coverage["features"]) == 9
    first = coverage["features"][0]
    assert first["geometry"]["type"] == "Polygon"
    assert first["properties"]["crs"] == "EPSG:32632"
    assert first["properties"]["cell_m"] == pytest.approx(30.0, rel=2e-3)
    assert str(tiles.parent) not in answer.text


@pytest.mark.parametrize(
    ("body", "status", "kind", "sentence"),
    [
        ({"area": {**MIDDLE, "lon_deg": 12.0}}, 422, "no-ground", "the nearest is tile_"),
        ({"area": {**MIDDLE, "radius_m": 3e5}, "cell_m": 0.5}, 422, "dem-too-large", "more than the limit"),
        ({"area": {"west_m": 0.0, "south_m": 0.0, "east_m": 5.0, "north_m": 5.0}}, 422, "frame", "name the CRS"),
        ({"area": {**MIDDLE, "radius_m": -1.0}}, 422, "validation", "area.radius_m: Input should be greater than 0"),
        ({"area": {**MIDDLE, "radius_m": 1e9}}, 422, "ground-area", "1,000,000 km, is more than a quarter"),
        ({"area": MIDDLE, "cell_m": 1e6}, 422, "ground-area", "Cells of 1e+06 m are larger than the area, which"),
        (
            {"area": {"west_deg": 1.0, "south_deg": 5.0, "east_deg": 2.0, "north_deg": 4.0}},
            422, "ground-area", "south must lie below north",
        ),
        ({"area": MIDDLE, "crs": "EPSG:4326"}, 422, "dem-unsupported", "must be a projected CRS in metres"),
        ({"area": MIDDLE, "crs": "EPSG:0"}, 422, "frame", "is not known"),
        ({"area": MIDDLE, "body": "Moon"}, 422, "no-ground", "holds no tile of Moon"),
        ({"area": MIDDLE, "url": "http://example.com"}, 422, "validation", "url"),
        ({}, 422, "validation", "area"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_with_one_sentence(
    server: Server, tiles: Path, body: dict[str, Any], status: int, kind: str, sentence: str
) -> None:
    answer = ask(server, **body)
    problem = answer.json()
    assert (answer.status_code, problem["type"]) == (status, f"/problems/{kind}"), answer.text
    assert sentence in problem["detail"]


def test_a_library_that_changed_is_a_conflict(server: Server, tiles: Path) -> None:
    for path in tiles.iterdir():
        found = path.stat()
        os.utime(path, ns=(found.st_atime_ns, found.st_mtime_ns + 10**9))
    answer = ask(server, area=MIDDLE)
    assert (answer.status_code, answer.json()["type"]) == (409, "/problems/ground-changed"), answer.text
    assert "was changed since it was indexed" in answer.json()["detail"]


def test_half_a_tile_is_refused(server: Server, tiles: Path) -> None:
    noise = np.random.default_rng(3).normal(size=(41, 51)).astype("f4")
    tile = write_tif(tiles / "tile_0_0.tif", noise, transform=METRES)
    tile.write_bytes(tile.read_bytes()[:3000])
    with edited(server.folder / LIBRARY) as editing:
        editing.library, told = index_ground(editing.library)
    assert told.changed == 1
    corner = {"west_m": 700_100.0, "south_m": 5_099_500.0, "east_m": 700_500.0, "north_m": 5_099_900.0}
    answer = ask(server, area=corner, crs="EPSG:32632")
    assert (answer.status_code, answer.json()["type"]) == (422, "/problems/dem-format"), answer.text
    assert "tile_0_0.tif is damaged or cut short" in answer.json()["detail"]


def test_a_body_that_is_no_json_or_comes_with_a_query_is_refused(server: Server) -> None:
    json_type = {"Content-Type": "application/json"}
    assert server.client.post("/dems", content=b"{", headers=json_type).status_code == 400
    answer = server.client.post("/dems", params={"band": 1}, json={"area": MIDDLE})
    assert answer.status_code == 422
    assert "leave out the query" in answer.json()["detail"]
