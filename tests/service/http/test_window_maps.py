"""A tile of any size as a DEM that stays in its file, and maps of it by windows, over HTTP."""

from __future__ import annotations

import io
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio

from service.ground.coverage import LIBRARY
from service.products.windows.calculate import make_large_map
from service.products.windows.files import COUNT, LOWEST
from terrain import GroundLibrary, index_ground, open_dem
from terrain.tiles.library import edited
from tests.service.http.test_bad_requests import assert_problem
from tests.service.large_dems import POSTS, anchors, hills_m, parameters, write_cog
from tests.service.running import Server

WAIT = {"Prefer": "wait=60"}
RESOLUTION_M = 20.0  # of posts every 5 m: the second overview, with 300 × 300


@pytest.fixture(scope="module")
def cog(server: Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A raster in the library of the service, which is emptied again."""
    folder = tmp_path_factory.mktemp("tiles")
    path = write_cog(folder / "hills.tif", hills_m(), BLOCKSIZE=128, OVERVIEW_RESAMPLING="AVERAGE")
    with edited(server.folder / LIBRARY) as editing:
        editing.library, _ = index_ground(GroundLibrary(), [folder])
    yield path
    (server.folder / LIBRARY).unlink()


@pytest.fixture(scope="module")
def dem(server: Server, cog: Path) -> dict[str, Any]:
    answer = server.client.post("/dems", json={"tile": "hills.tif", "resolution_m": RESOLUTION_M})
    assert answer.status_code == 201, answer.text
    return dict(answer.json())


def test_a_tile_is_a_dem_that_holds_an_overview_and_tells_of_the_posts(
    server: Server, cog: Path, dem: dict[str, Any]
) -> None:
    with rasterio.open(cog, overview_level=1) as coarse:
        expected_m, transform = coarse.read(1), coarse.transform
    assert (dem["rows"], dem["cols"], dem["cell_east_m"]) == (*expected_m.shape, transform.a)
    assert dem["transform"] == pytest.approx(list(transform)[:6])
    assert dem["overview_of"] == {
        "name": "hills.tif", "rows": POSTS, "cols": POSTS, "cell_east_m": 5.0, "cell_north_m": 5.0
    }  # fmt: skip
    assert "overview with cells of 20 m, in place of 5 m" in dem["conversions"][0]
    heights = np.frombuffer(server.client.get(f"/dems/{dem['id']}/heights").content, "<f4")
    assert np.array_equal(heights.reshape(expected_m.shape), expected_m, equal_nan=True)
    again = server.client.post("/dems", json={"tile": "hills.tif", "resolution_m": RESOLUTION_M})
    assert (again.status_code, again.json()["id"]) == (200, dem["id"])
    assert str(cog.parent) not in again.text


def test_an_upload_is_read_as_coarse_as_it_is_asked_for(server: Server, tmp_path: Path) -> None:
    small = write_cog(tmp_path / "small.tif", hills_m(600), BLOCKSIZE=128, OVERVIEW_RESAMPLING="AVERAGE")
    coarse, whole = server.upload(small, resolution_m=10.0), server.upload(small)
    assert (coarse["rows"], coarse["cols"], coarse["cell_east_m"]) == (300, 300, 10.0)
    assert (whole["rows"], coarse["overview_of"]) == (600, None)


def test_its_map_is_the_one_of_the_command_line_and_downloads_in_parts(
    server: Server, cog: Path, dem: dict[str, Any], tmp_path: Path
) -> None:
    body = {"dem_id": dem["id"], "anchors": anchors(), "receiver_above_ground_m": 1.5}
    answer = server.client.post("/window-maps", json=body, headers=WAIT, timeout=120.0)
    assert answer.status_code == 201, answer.text
    job = answer.json()
    expected = make_large_map(open_dem(cog), parameters(), tmp_path)
    assert job["result"]["anchors"] == expected.model_dump(mode="json")["anchors"]
    assert (job["result"]["dem"]["rows"], job["result"]["dem"]["cell_east_m"]) == (POSTS, 5.0)
    for name in (COUNT, LOWEST):
        whole = server.client.get(f"{job['links']['self']}/layers/{name}")
        part = server.client.get(f"{job['links']['self']}/layers/{name}", headers={"Range": "bytes=100-199"})
        assert (part.status_code, part.content) == (206, whole.content[100:200])
        with rasterio.open(io.BytesIO(whole.content)) as found, rasterio.open(tmp_path / name) as wanted:
            assert found.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG"
            assert found.overviews(1)
            assert found.transform == wanted.transform
            assert np.array_equal(found.read(), wanted.read(), equal_nan=True)
    assert {path.name for path in (server.folder / "work").iterdir()} == set()


def test_without_a_range_limit_it_is_refused_with_what_it_would_take(server: Server, dem: dict[str, Any]) -> None:
    unlimited = [{key: value for key, value in one.items() if key != "max_range_m"} for one in anchors()]
    refused = server.client.post("/window-maps", json={"dem_id": dem["id"], "anchors": unlimited})
    assert_problem(
        refused, 422, "request", "all 1,440,000 posts of hills.tif are in its reach, which take about 0.035 GB"
    )


def test_it_is_ended_while_it_runs_and_leaves_nothing(server: Server, dem: dict[str, Any]) -> None:
    many = [{**anchor, "id": f"{anchor['id']}{n}", "max_range_m": 3000.0} for n in range(8) for anchor in anchors()]
    body = {"dem_id": dem["id"], "anchors": many, "mode": "exact"}
    here = server.client.post("/window-maps", json=body).headers["Location"]
    until = time.monotonic() + 60.0
    seen = [0.0]
    while time.monotonic() < until and seen[-1] == 0.0:
        seen.append(server.client.get(here).json()["progress"])
        time.sleep(0.05)
    assert 0.0 < seen[-1] < 1.0
    ended = server.client.delete(here)
    assert (ended.status_code, ended.json()["status"]) == (200, "cancelled")
    assert [path for path in (server.folder / "work").iterdir() if "removed" not in path.name] == []


@pytest.mark.parametrize(
    ("body", "status", "kind", "sentence"),
    [
        ({"tile": "peaks.tif"}, 404, "not-found", "no tile 'peaks.tif'; GET /ground lists"),
        ({"tile": "hills.tif", "margin_m": 5.0}, 422, "validation", "margin_m goes with an area"),
        ({"tile": "hills.tif", "area": {"lon_deg": 0, "lat_deg": 0, "radius_m": 1}}, 422, "validation", "exactly one"),
        ({"tile": "hills.tif", "resolution_m": 0}, 422, "validation", "resolution_m"),
    ],
)
def test_what_is_no_tile_is_refused(
    server: Server, cog: Path, body: dict[str, Any], status: int, kind: str, sentence: str
) -> None:
    assert_problem(server.client.post("/dems", json=body), status, kind, sentence)


def test_a_tile_that_changes_under_its_dem_is_told(server: Server, cog: Path, dem: dict[str, Any]) -> None:
    kept = cog.read_bytes()
    write_cog(cog, hills_m(seed=3))
    refused = server.client.post("/window-maps", json={"dem_id": dem["id"], "anchors": anchors()})
    assert_problem(refused, 409, "ground-changed", "hills.tif was changed")
    cog.write_bytes(kept)
