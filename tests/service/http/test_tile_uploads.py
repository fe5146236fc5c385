"""Tiles sent in one form: joined to one DEM as those of the ground library are, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
import rasterio

from terrain import read_dem
from tests.service.http.test_bad_requests import assert_problem
from tests.service.running import Server
from tests.terrain.files import write_tif
from tests.terrain.tiles.cutting import cut_tif, rough

METRES = rasterio.Affine(30, 0, 700_000, 0, -30, 5_100_000)
MOON = "+proj=stere +lat_0=-90 +R=1737400 +units=m +no_defs +type=crs"


def join(server: Server, paths: list[Path], **query: Any) -> httpx.Response:
    files = [("file", (path.name, path.read_bytes())) for path in paths]
    return server.client.post("/dems", params=query, files=files)


def heights_of(server: Server, dem: dict[str, Any]) -> np.ndarray:
    bare = server.client.get(f"/dems/{dem['id']}/heights").content
    return np.frombuffer(bare, "<f4").reshape(dem["rows"], dem["cols"])


def test_tiles_of_one_lattice_are_the_undivided_dem_post_for_post(server: Server, tmp_path: Path) -> None:
    heights_m = rough(50, 60, seed=3)
    heights_m[20:23, 30:33] = np.nan
    paths = cut_tif(tmp_path / "tiles", heights_m, METRES, shared=True)
    answer = join(server, paths)
    assert answer.status_code == 201, answer.text
    dem = answer.json()
    np.testing.assert_array_equal(heights_of(server, dem), heights_m)
    assert (dem["name"], dem["driver"], dem["crs"]) == ("mosaic of 9 tiles", "mosaic", "EPSG:32632")
    assert dem["unknown_posts"] == 9
    assert dem["file_bytes"] == sum(path.stat().st_size for path in paths)
    assert any("9 tiles on one lattice were put together" in told for told in dem["conversions"])
    again = join(server, paths[::-1])
    assert (again.status_code, again.json()["id"]) == (200, dem["id"])


def test_geographic_tiles_are_joined_before_they_are_warped(server: Server, tmp_path: Path) -> None:
    heights_m = rough(70, 80)
    seconds = rasterio.Affine(1.0 / 3600.0, 0, 11.5, 0, -1.0 / 3600.0, 46.5)
    undivided = read_dem(write_tif(tmp_path / "whole.tif", heights_m, transform=seconds, crs="EPSG:4326"))
    answer = join(server, cut_tif(tmp_path / "tiles", heights_m, seconds, shared=False, pieces=2, crs="EPSG:4326"))
    assert answer.status_code == 201, answer.text
    dem = answer.json()
    assert (dem["rows"], dem["cols"], dem["crs"]) == (*undivided.shape, "EPSG:32632")
    np.testing.assert_array_equal(heights_of(server, dem), undivided.heights_m)


def test_ground_between_tiles_and_tiles_that_differ_are_told(server: Server, tmp_path: Path) -> None:
    heights_m = rough(40, 40)
    first = write_tif(tmp_path / "a.tif", heights_m[:, :20], transform=METRES)
    other = heights_m[:, 19:30].copy()
    other[:, 0] += 2.0
    second = write_tif(tmp_path / "b.tif", other, transform=METRES @ rasterio.Affine.translation(19, 0))
    far = write_tif(tmp_path / "c.tif", heights_m[:, 35:], transform=METRES @ rasterio.Affine.translation(35, 0))
    dem = join(server, [first, second, far]).json()
    assert (dem["cols"], dem["unknown_posts"]) == (40, 40 * 5)
    warned = " ".join(dem["warnings"])
    assert "200 of 1,600 posts (12.5 %) lie in no tile" in warned
    assert "40 posts are held by two tiles that differ, by up to 2 m" in warned
    np.testing.assert_array_equal(heights_of(server, dem)[:, :20], heights_m[:, :20])


def test_what_is_no_tile_is_named_and_nothing_is_kept(server: Server, tmp_path: Path) -> None:
    heights_m = rough(30, 30, seed=5)
    good = write_tif(tmp_path / "good.tif", heights_m, transform=METRES)
    (bad := tmp_path / "bad.tif").write_bytes(b"no raster at all")
    placeless = tmp_path / "placeless.asc"
    placeless.write_text("ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 5\n1 2\n3 4\n")
    moon = write_tif(tmp_path / "moon.tif", heights_m, transform=METRES, crs=MOON)
    before = server.client.get("/dems").json()["total"]
    assert_problem(join(server, [good, bad]), 422, "dem-format", "bad.tif")
    assert_problem(join(server, [good, placeless]), 422, "dem-unsupported", "placeless.asc has no CRS")
    assert_problem(join(server, [good, moon]), 422, "dem-unsupported", "several bodies (Earth, Moon)")
    assert_problem(
        join(server, [good, good], height_unit="ft"), 422, "request", "leave out filename and reading options"
    )
    (tmp_path / "empty.tif").touch()
    assert_problem(join(server, [good, tmp_path / "empty.tif"]), 422, "request", "empty.tif is empty")
    assert_problem(join(server, [good] * 101), 422, "request", "more than 100 files")
    assert server.client.get("/dems").json()["total"] == before


@pytest.mark.parametrize("route", ["/missions", "/range-logs"])
def test_where_one_file_is_meant_several_are_refused(server: Server, route: str) -> None:
    files = [("file", (name, b"{}")) for name in ("one.json", "two.json")]
    assert_problem(server.client.post(route, files=files), 422, "request", "send one at a time")


@pytest.mark.parametrize("cell_m", [1e-9, 1e-200])
def test_tiles_that_are_endlessly_fine_together_are_too_large(server: Server, tmp_path: Path, cell_m: float) -> None:
    fine = rasterio.Affine(cell_m, 0, 700_000, 0, -cell_m, 5_100_000)
    paths = [
        write_tif(tmp_path / "fine.tif", rough(4, 4), transform=fine, crs="EPSG:32632"),
        write_tif(tmp_path / "coarse.tif", rough(4, 4), transform=METRES, crs="EPSG:32632"),
    ]
    answer = join(server, paths)
    assert answer.status_code in (413, 422), answer.text
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert server.client.get("/health").json()["workers"]["warm"] > 0
