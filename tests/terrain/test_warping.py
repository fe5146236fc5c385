"""Degrees, and maps that stretch, are warped to metres without leaving the file's own surface."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio

from terrain import ElevationGrid, height_at, read_dem, to_grid_frame, to_lon_lat
from tests.terrain.files import hill, sentences, write_tif

DEGREE_TRANSFORM = rasterio.Affine(0.001, 0, 11.9, 0, -0.002, 47.0)


def conversions_of(grid: ElevationGrid) -> str:
    return sentences(*grid.provenance.conversions)


@pytest.mark.parametrize(
    ("transform", "crs", "expected"),
    [
        (DEGREE_TRANSFORM, "EPSG:4326", 32632),
        (rasterio.Affine(0.001, 0, 12.1, 0, -0.001, -33.0), "EPSG:4326", 32733),
        (rasterio.Affine(0.001, 0, -71.0, 0, -0.001, 44.0), "EPSG:4269", 26919),
        (rasterio.Affine(0.001, 0, 179.995, 0, -0.001, -16.0), "EPSG:4326", 32701),
        (rasterio.Affine(0.001, 0, 371.9, 0, -0.001, 47.0), "EPSG:4326", 32632),
    ],
)
def test_degrees_are_warped_to_the_local_utm_zone(tmp_path: Path, transform: Any, crs: str, expected: int) -> None:
    grid = read_dem(write_tif(tmp_path / "dem.tif", hill(), crs=crs, transform=transform))
    assert grid.crs is not None
    assert grid.crs.to_epsg() == expected
    assert "Warped from" in conversions_of(grid)
    rows, cols = np.mgrid[2:10:2, 2:13:2]
    lon, lat = transform @ (cols + 0.5, rows + 0.5)
    lon = (lon + 180.0) % 360.0 - 180.0
    here = height_at(grid, *to_grid_frame(grid, lon, lat))
    np.testing.assert_allclose(here, hill()[rows, cols], atol=6.0)


@pytest.mark.parametrize(
    ("transform", "crs"),
    [
        (rasterio.Affine(0.5, 0, 20.0, 0, -0.1, 89.5), "EPSG:4326"),
        (rasterio.Affine(30.0, 0, -180.0, 0, -0.01, 90.0), "EPSG:4326"),
        (rasterio.Affine(1.0, 0, 5.0, 0, -0.5, 50.0), "EPSG:4326"),
        (rasterio.Affine(0.01, 0, 137.0, 0, -0.01, -4.0), "ESRI:104905"),
        (rasterio.Affine(0.01, 0, 3.0, 0, -0.01, 26.0), "ESRI:104903"),
    ],
)
def test_where_utm_does_not_serve_the_map_is_azimuthal_equidistant(tmp_path: Path, transform: Any, crs: str) -> None:
    rows, cols = np.mgrid[0:12, 0:12]
    heights = (300.0 + 5.0 * rows).astype("f4")  # no seam where the last column meets the first
    grid = read_dem(write_tif(tmp_path / "dem.tif", heights, crs=crs, transform=transform))
    assert grid.crs is not None
    assert grid.crs.coordinate_operation is not None
    assert "Azimuthal Equidistant" in grid.crs.coordinate_operation.method_name
    middle = (slice(3, 9, 2), slice(3, 9, 2))
    lon, lat = transform @ (cols[middle] + 0.5, rows[middle] + 0.5)
    lon = np.where(lon > 180, lon - 360, lon)
    np.testing.assert_allclose(height_at(grid, *to_grid_frame(grid, lon, lat)), heights[middle], atol=2.6)
    assert np.nanmin(grid.heights_m) >= 300.0


def test_around_a_pole_the_circle_closes_without_a_seam(tmp_path: Path) -> None:
    transform = rasterio.Affine(3.0, 0, -180.0, 0, -0.01, 90.0)
    grid = read_dem(
        write_tif(tmp_path / "dem.tif", np.full((40, 120), 250.0, "f4"), crs="EPSG:4326", transform=transform)
    )
    north_m = np.linspace(2_000.0, 40_000.0, 30)
    seam = height_at(grid, 0.0, north_m)  # the meridian of 180°, where the last column meets the first
    np.testing.assert_allclose(seam, 250.0)


def test_a_warped_plane_stays_a_plane_and_cells_keep_the_resolution(tmp_path: Path) -> None:
    rows, cols = np.mgrid[0:40, 0:50]
    plane = (1000.0 - 3.0 * rows + 2.0 * cols).astype("f4")
    grid = read_dem(write_tif(tmp_path / "d.tif", plane, crs="EPSG:4326", transform=DEGREE_TRANSFORM))
    assert grid.cell_east_m == pytest.approx(0.001 * 111_320 * np.cos(np.radians(46.96)), rel=0.01)
    assert grid.cell_north_m == pytest.approx(0.002 * 111_170, rel=0.01)
    r, c = np.mgrid[0 : grid.rows, 0 : grid.cols]
    east, north = grid.position_of(r, c)
    lon, lat = to_lon_lat(grid, east, north)
    expected = 1000.0 - 3.0 * ((47.0 - lat) / 0.002 - 0.5) + 2.0 * ((lon - 11.9) / 0.001 - 0.5)
    known = ~np.isnan(grid.heights_m)
    assert known.mean() > 0.85
    np.testing.assert_allclose(grid.heights_m[known], expected[known], atol=0.02)


def test_a_void_costs_exactly_the_triangles_it_belongs_to(tmp_path: Path) -> None:
    heights = np.full((30, 30), 700.0, "f4")
    heights[12, 14] = -9999.0
    grid = read_dem(write_tif(tmp_path / "d.tif", heights, nodata=-9999, crs="EPSG:4326", transform=DEGREE_TRANSFORM))
    assert set(np.unique(grid.heights_m[~np.isnan(grid.heights_m)])) == {700.0}
    lon, lat = DEGREE_TRANSFORM @ (14.5, 12.5)
    assert np.isnan(height_at(grid, *to_grid_frame(grid, lon, lat)))
    r, c = np.mgrid[0 : grid.rows, 0 : grid.cols]
    lons, lats = to_lon_lat(grid, *grid.position_of(r, c))
    cols_away, rows_away = np.abs((lons - lon) / 0.001), np.abs((lats - lat) / 0.002)
    beyond = (np.maximum(cols_away, rows_away) > 1.0) & (np.minimum(lons - 11.9005, 11.9295 - lons) > 1e-6)
    beyond &= np.minimum(46.999 - lats, lats - 46.941) > 1e-6
    assert not np.isnan(grid.heights_m[beyond]).any()


def test_web_mercator_is_not_taken_for_metres(tmp_path: Path) -> None:
    transform = rasterio.Affine(30, 0, 1_300_000, 0, -30, 5_900_000)
    path = write_tif(tmp_path / "dem.tif", np.tile(hill(), (4, 4)), crs="EPSG:3857", transform=transform)
    grid = read_dem(path)
    assert grid.crs is not None
    assert grid.crs.to_epsg() == 32632
    assert grid.cell_east_m == pytest.approx(30 * np.cos(np.radians(46.7)), rel=0.01)
    assert "makes 1.4" in conversions_of(grid)
    asked = read_dem(path, target_crs="EPSG:3857")
    assert asked.cell_east_m == 30.0, "the caller may insist"
