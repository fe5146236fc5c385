"""A resolution that is asked for reads the overview of the file that means it, as GDAL gives it, and says so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import rasterio

from terrain import (
    Box,
    DemReadError,
    DemTooLargeError,
    LargeDem,
    open_dem,
    read_dem,
    read_mosaic,
    read_tile,
    write_npz,
)
from tests.service.large_dems import CELL_M, NORTH_M, WEST_M, hills_m, write_cog

UTM = "EPSG:32611"


@pytest.fixture(scope="module")
def cog(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """601 × 601 posts of 5 m with overviews of odd sizes."""
    path = tmp_path_factory.mktemp("cog") / "odd.tif"
    return write_cog(path, hills_m(601), BLOCKSIZE=128, OVERVIEW_RESAMPLING="AVERAGE")


@pytest.mark.parametrize(
    ("resolution_m", "level"), [(4.0, None), (9.9, None), (10.02, 0), (19.0, 0), (20.1, 1), (1e6, 2)]
)
def test_the_coarsest_level_that_is_no_coarser_is_read_as_it_stands(
    cog: Path, resolution_m: float, level: int | None
) -> None:
    grid = read_dem(cog, resolution_m=resolution_m)
    with rasterio.open(cog) if level is None else rasterio.open(cog, overview_level=level) as wanted:
        assert np.array_equal(grid.heights_m, wanted.read(1), equal_nan=True)
        assert (grid.cell_east_m, grid.cell_north_m) == pytest.approx((wanted.transform.a, -wanted.transform.e))
        assert (grid.origin_east_m, grid.origin_north_m) == pytest.approx(wanted.xy(0, 0))
    told = " ".join(grid.provenance.conversions)
    assert ("overview with cells of" if level is not None else "no overview with cells of") in told
    assert grid.crs == read_dem(cog).crs


def test_a_file_without_overviews_is_read_as_ever_which_is_told(tmp_path: Path) -> None:
    path = write_cog(tmp_path / "plain.tif", hills_m(100))
    grid = read_dem(path, resolution_m=50.0)
    assert np.array_equal(grid.heights_m, read_dem(path).heights_m, equal_nan=True)
    assert "The file has no overviews, so its own posts, 5 m apart, were read." in grid.provenance.conversions
    write_npz(grid, tmp_path / "plain.npz")
    assert "no overviews" in read_dem(tmp_path / "plain.npz", resolution_m=50.0).provenance.conversions[0]


def test_an_area_of_tiles_is_made_of_their_overviews(cog: Path) -> None:
    box = Box(WEST_M + 500.0, NORTH_M - 2000.0, WEST_M + 2200.0, NORTH_M - 700.0, UTM)
    fine, coarse = read_mosaic([cog], box), read_mosaic([cog], box, resolution_m=25.0)
    whole = read_dem(cog, resolution_m=25.0)
    row, col = whole.post_at(coarse.origin_east_m, coarse.origin_north_m)
    assert (row, col) == pytest.approx((round(row), round(col)))
    part = whole.window(round(row), round(row) + coarse.rows - 1, round(col), round(col) + coarse.cols - 1)
    assert np.array_equal(coarse.heights_m, part.heights_m, equal_nan=True)
    assert coarse.bounds_m[0] <= box.west < box.east <= coarse.bounds_m[2]
    assert fine.cell_east_m == CELL_M
    assert any("overview with cells of 20 m" in sentence for sentence in coarse.provenance.conversions)


def test_tiles_of_degrees_count_their_cells_in_metres_of_ground(tmp_path: Path) -> None:
    path = write_cog(tmp_path / "degrees.tif", hills_m(600), BLOCKSIZE=128)
    with rasterio.open(path, "r+", IGNORE_COG_LAYOUT_BREAK="YES") as file:  # 0.0003 degrees at 60 north: 33.4 × 16.7 m
        file.crs, file.transform = "EPSG:4326", rasterio.Affine(0.0003, 0.0, 10.0, 0.0, -0.0003, 60.09)
    assert read_tile(path).cell_m == pytest.approx(23.65, rel=2e-3)
    assert "cells of 47.3 m, in place of 23.7 m" in read_mosaic([path], resolution_m=60.0).provenance.conversions[0]


def test_a_resolution_is_a_number_of_metres(cog: Path) -> None:
    for wrong in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(DemReadError, match="resolution_m must be a positive number of metres"):
            read_dem(cog, resolution_m=wrong)


def test_a_large_dem_has_an_overview_that_knows_it(cog: Path, tmp_path: Path) -> None:
    dem = open_dem(cog)
    grid = dem.overview(max_cells=50_000)
    assert grid.shape == (150, 150)
    assert grid.provenance.overview_of == dem
    assert isinstance(grid.provenance.overview_of, LargeDem)
    assert dem.overview(max_cells=50_000, resolution_m=45.0).shape == (75, 75)
    assert dem.frame().bounds_m == pytest.approx(dem.bounds_m)
    plain = open_dem(write_cog(tmp_path / "plain.tif", hills_m(100)))
    assert plain.overview(max_cells=10_000).shape == (100, 100)
    with pytest.raises(DemTooLargeError, match=r"10,000 posts and no overview of 9,999 or fewer; gdaladdo"):
        plain.overview(max_cells=9_999)
