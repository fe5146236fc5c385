"""A DEM that was cut reads equal to the undivided one, post for post."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import rasterio

from terrain import Box, ElevationGrid, height_at, read_dem, read_mosaic, to_lon_lat
from tests.terrain.files import write_asc, write_tif
from tests.terrain.tiles.cutting import SECONDS_3, cut_tif, rough, write_hgt

METRES = rasterio.Affine(10, 0, 500_000, 0, -10, 5_000_000)
DEGREES = rasterio.Affine(SECONDS_3, 0, 10.0, 0, -SECONDS_3, 47.0)


def assert_one_ground(mosaic: ElevationGrid, whole: ElevationGrid) -> None:
    assert mosaic.shape == whole.shape
    np.testing.assert_array_equal(mosaic.heights_m, whole.heights_m)
    assert (mosaic.cell_east_m, mosaic.cell_north_m) == (whole.cell_east_m, whole.cell_north_m)
    assert (mosaic.origin_east_m, mosaic.origin_north_m) == (whole.origin_east_m, whole.origin_north_m)
    assert mosaic.crs == whole.crs
    assert mosaic.digest == whole.digest


@pytest.mark.parametrize("shared", [False, True], ids=["cells", "shared edges"])
@pytest.mark.parametrize(
    ("transform", "crs"), [(METRES, "EPSG:32632"), (DEGREES, "EPSG:4326")], ids=["metres", "degrees"]
)
def test_three_by_three_tiles_are_the_whole(tmp_path: Path, shared: bool, transform: rasterio.Affine, crs: str) -> None:
    heights = rough(97, 121)
    heights[40:44, 60:66] = np.nan
    whole = read_dem(write_tif(tmp_path / "whole.tif", heights, transform=transform, crs=crs))
    tiles = cut_tif(tmp_path / "cut", heights, transform, shared=shared, crs=crs)
    assert len(tiles) == 9
    assert_one_ground(read_mosaic(tiles), whole)
    assert_one_ground(read_mosaic(tiles[::-1]), whole)


def test_tiles_in_feet_are_the_whole(tmp_path: Path) -> None:
    heights = rough(50, 61)
    profile = {"crs": "EPSG:2277", "units": ["US survey foot"]}
    transform = rasterio.Affine(30, 0, 3_100_000, 0, -30, 10_100_000)
    whole = read_dem(write_tif(tmp_path / "whole.tif", heights, transform=transform, **profile))
    mosaic = read_mosaic(cut_tif(tmp_path / "cut", heights, transform, shared=True, **profile))
    assert_one_ground(mosaic, whole)
    assert any("converted from US survey foot" in sentence for sentence in mosaic.provenance.conversions)


def test_srtm_tiles_share_their_edge_rows_once(tmp_path: Path) -> None:
    heights = np.round(rough(2401, 2401)).astype(np.int16)
    transform = rasterio.Affine(SECONDS_3, 0, 10.0 - SECONDS_3 / 2, 0, -SECONDS_3, 47.0 + SECONDS_3 / 2)
    whole = read_dem(write_tif(tmp_path / "whole.tif", heights, transform=transform, crs="EPSG:4326"))
    tiles = [
        write_hgt(tmp_path / "hgt", heights[row : row + 1201, col : col + 1201], 10 + col // 1200, 46 - row // 1200)
        for row in (0, 1200)
        for col in (0, 1200)
    ]
    mosaic = read_mosaic(tiles)
    np.testing.assert_array_equal(mosaic.heights_m, whole.heights_m)
    assert mosaic.shape == whole.shape
    assert mosaic.bounds_m == pytest.approx(whole.bounds_m, abs=1e-6)
    assert mosaic.vertical_datum == "EGM96 geoid"


def test_ascii_tiles_with_their_prj_are_the_whole(tmp_path: Path) -> None:
    heights = np.round(rough(40, 40), 3)
    left, right = write_asc(tmp_path / "a.asc", heights[:, :25]), write_asc(tmp_path / "b.asc", heights[:, 24:])
    right.write_text(right.read_text().replace("xllcorner 100", "xllcorner 340"))
    for path in (left, right):
        path.with_suffix(".prj").write_text(rasterio.CRS.from_epsg(32632).to_wkt())
    mosaic = read_mosaic([left, right])
    np.testing.assert_allclose(mosaic.heights_m, heights, atol=1e-3)
    assert mosaic.position_of(39, 0) == (105.0, 205.0)


def test_an_area_is_a_window_of_the_whole(tmp_path: Path) -> None:
    heights = rough(97, 121)
    whole = read_dem(write_tif(tmp_path / "whole.tif", heights))
    tiles = cut_tif(tmp_path / "cut", heights, METRES, shared=True)
    area = Box(500_231.0, 4_999_407.0, 500_777.0, 4_999_689.0, frame="EPSG:32632")
    part = read_mosaic(tiles, area)
    top, left = (round(float(at)) for at in whole.post_at(part.origin_east_m, part.origin_north_m))
    expected = whole.window(top, top + part.rows - 1, left, left + part.cols - 1)
    assert_one_ground(part, expected)
    west, south, east, north = part.bounds_m
    assert west <= 500_231.0 < west + 10.0
    assert south <= 4_999_407.0 < south + 10.0
    assert east >= 500_777.0 > east - 10.0
    assert north >= 4_999_689.0 > north - 10.0


def test_an_area_of_tiles_in_degrees_has_no_unknown_corners(tmp_path: Path) -> None:
    heights = rough(600, 700)
    part = read_mosaic(
        cut_tif(tmp_path / "cut", heights, DEGREES, shared=False, crs="EPSG:4326"), Box(10.2, 46.65, 10.4, 46.8)
    )
    assert part.unknown_posts == 0
    # every post lies on the triangulated surface of the whole, here with its cells as metres
    surface = ElevationGrid(heights, 1.0, 1.0)
    cols, rows = np.meshgrid(np.arange(part.cols), np.arange(part.rows))
    lon, lat = to_lon_lat(part, *part.position_of(rows, cols))
    col, row = (lon - DEGREES.c) / SECONDS_3 - 0.5, (DEGREES.f - lat) / SECONDS_3 - 0.5
    steepest_m = max(np.abs(np.diff(heights, axis=axis)).max() for axis in (0, 1))
    off_m = np.abs(part.heights_m - height_at(surface, col.ravel(), -row.ravel()).reshape(part.shape))
    assert off_m.max() < 0.02 * steepest_m, "posts are placed within a hundredth of a cell"
