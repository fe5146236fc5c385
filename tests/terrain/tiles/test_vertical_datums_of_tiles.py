"""Tiles that count heights from different zeros become one DEM through the geoid, or are refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import rasterio

from terrain import VerticalDatumError, parse_vertical_datum, read_mosaic
from tests.terrain.files import write_tif

# (lat_deg, lon_deg, metres of EGM96 above the ellipsoid): NGA's OUTINTPT.DAT, which comes with its grid
PUBLISHED = ((46.8743190, 102.4487290, -43.575), (38.6281550, -90.2208860, -31.628), (-23.6174460, 133.8747120, 15.871))
SECOND = 1.0 / 3600.0
POSTS = 21


def tile_at(path: Path, lat_deg: float, lon_deg: float, height_m: float, crs: str) -> Path:
    """Level ground of 21² posts, a second apart, around a place."""
    half = (POSTS / 2.0) * SECOND
    at = rasterio.Affine(SECOND, 0.0, lon_deg - half, 0.0, -SECOND, lat_deg + half)
    return write_tif(path, np.full((POSTS, POSTS), height_m, np.float32), crs=crs, transform=at)


@pytest.mark.parametrize(("lat_deg", "lon_deg", "geoid_m"), PUBLISHED)
def test_heights_above_the_ellipsoid_come_down_by_the_published_height_of_the_geoid(
    tmp_path: Path, lat_deg: float, lon_deg: float, geoid_m: float
) -> None:
    """100 m above the sea on both sides of a seam."""
    beside_deg = lon_deg - POSTS * SECOND
    tiles = [
        tile_at(tmp_path / "a.tif", lat_deg, beside_deg, 100.0, "EPSG:4326+5773"),
        tile_at(tmp_path / "b.tif", lat_deg, lon_deg, 100.0 + geoid_m, "EPSG:4979"),
    ]
    grid = read_mosaic(tiles)
    assert parse_vertical_datum(str(grid.vertical_datum)) == parse_vertical_datum("EGM96")
    assert np.nanmax(np.abs(grid.heights_m - 100.0)) < 0.05  # the geoid slopes by up to 0.1 m a kilometre
    told = next(one for one in grid.provenance.conversions if "brought from" in one)
    assert told.startswith("Heights of 1 tile brought from ")
    lowest_m, highest_m = (float(word) for word in told.rstrip(" m.").split(": ")[1].split(" to "))
    assert lowest_m - 0.01 < -geoid_m < highest_m + 0.01


def test_coarser_tiles_of_another_map_are_brought_too(tmp_path: Path) -> None:
    """The finest tile counts from the ellipsoid, so the mosaic does; the coarser one around it rises by the geoid."""
    lat_deg, lon_deg, geoid_m = PUBLISHED[0]
    fine = tile_at(tmp_path / "fine.tif", lat_deg, lon_deg, 100.0, "EPSG:4979")
    half = 20 * 3.0 * SECOND
    at = rasterio.Affine(3.0 * SECOND, 0.0, lon_deg - half, 0.0, -3.0 * SECOND, lat_deg + half)
    coarse = write_tif(
        tmp_path / "coarse.tif", np.full((40, 40), 500.0, np.float32), crs="EPSG:4326+5773", transform=at
    )
    grid = read_mosaic([coarse, fine])
    heights_m = grid.heights_m[~np.isnan(grid.heights_m)]
    assert "ellips" in (grid.vertical_datum or "").lower() or "WGS 84" in (grid.vertical_datum or "")
    above_m = heights_m[np.abs(heights_m - 100.0) > 50.0]
    assert above_m.size > 800
    assert np.median(above_m) == pytest.approx(500.0 + geoid_m, abs=0.2)
    assert np.count_nonzero(heights_m == 100.0) > 300


def test_two_sea_levels_without_a_model_between_them_are_refused_with_what_is_missing(tmp_path: Path) -> None:
    lat_deg, lon_deg, _ = PUBLISHED[0]
    tiles = [
        tile_at(tmp_path / "a.tif", lat_deg, lon_deg - POSTS * SECOND, 100.0, "EPSG:4326+5773"),
        tile_at(tmp_path / "b.tif", lat_deg, lon_deg, 100.0, "EPSG:4326+5703"),
    ]
    with pytest.raises(VerticalDatumError, match=r"NAVD88 height cannot be brought to EGM96 geoid: PROJ lacks "):
        read_mosaic(tiles)


def test_tiles_that_do_not_say_are_told_and_stay_as_they_are(tmp_path: Path) -> None:
    lat_deg, lon_deg, _ = PUBLISHED[0]
    tiles = [
        tile_at(tmp_path / "a.tif", lat_deg, lon_deg - POSTS * SECOND, 100.0, "EPSG:4979"),
        tile_at(tmp_path / "b.tif", lat_deg, lon_deg, 100.0, "EPSG:4326"),
    ]
    grid = read_mosaic(tiles)
    assert np.nanmax(np.abs(grid.heights_m - 100.0)) == 0.0
    assert any("1 tiles do not say what heights count from" in one for one in grid.provenance.warnings)
