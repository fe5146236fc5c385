"""Each DEM made by others carries a trap; read_dem steps around it and says so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyproj
import pytest
import rasterio

from terrain import DemReadError, ElevationGrid, body_of, height_at, read_dem, to_grid_frame, to_lon_lat
from tests.terrain.files import SHARED_DEMS, needs_shared, sentences

pytestmark = needs_shared
DEMS = sorted(path for path in SHARED_DEMS.glob("*.*") if path.suffix != ".json")


def read(name: str, **options: object) -> ElevationGrid:
    return read_dem(SHARED_DEMS / name, **options)


def highest(grid: ElevationGrid) -> tuple[float, float]:
    """(lon, lat) of the highest post."""
    row, col = np.unravel_index(np.nanargmax(grid.heights_m), grid.shape)
    return to_lon_lat(grid, *grid.position_of(float(row), float(col)))


@pytest.mark.parametrize(
    "path", sorted(p for p in SHARED_DEMS.glob("*.*") if p.suffix != ".json"), ids=lambda p: p.name
)
def test_every_file_becomes_a_grid_in_metres(path: Path) -> None:
    grid = read_dem(path)
    assert grid.heights_m.dtype == np.float32
    assert not grid.heights_m.flags.writeable
    assert grid.provenance.source == path.name
    assert grid.crs is None or {axis.unit_name for axis in grid.crs.axis_info} == {"metre"}
    assert np.isfinite(grid.heights_m).any()
    assert all(text.endswith(".") for text in (*grid.provenance.conversions, *grid.provenance.warnings))


def test_a_metric_geotiff_is_left_as_it_is() -> None:
    grid = read("bigtujunga.tif")
    with rasterio.open(SHARED_DEMS / "bigtujunga.tif") as dataset:
        np.testing.assert_array_equal(grid.heights_m, dataset.read(1))
        assert grid.position_of(0, 0) == dataset.xy(0, 0), "posts are cell centres"
    assert (grid.cell_east_m, grid.cell_north_m, grid.unknown_posts) == (30.0, 30.0, 0)
    assert grid.crs is not None
    assert grid.crs.to_epsg() == 32611
    assert grid.provenance.conversions == grid.provenance.warnings == ()


def test_the_summit_of_mount_washington_is_in_its_place() -> None:
    grid = read("N44W072.hgt")
    lon, lat = highest(grid)
    assert (lon, lat) == pytest.approx((-71.3033, 44.2705), abs=0.0005)
    assert float(height_at(grid, *to_grid_frame(grid, -71.3033, 44.2705))) > 1890.0
    assert grid.vertical_datum == "EGM96 geoid"


def test_hgt_posts_stand_on_whole_arc_seconds_and_half_a_cell_would_show() -> None:
    grid = read("N44W072.hgt")
    with rasterio.open(SHARED_DEMS / "N44W072.hgt") as dataset:
        posts = dataset.read(1).astype(float)
    rows, cols = np.mgrid[100:1100:37, 100:1100:41]
    lon, lat = -72.0 + cols / 1200.0, 45.0 - rows / 1200.0
    known = posts[rows, cols]
    error_m = np.abs(height_at(grid, *to_grid_frame(grid, lon, lat)) - known)
    shifted_m = np.abs(height_at(grid, *to_grid_frame(grid, lon + 0.5 / 1200, lat - 0.5 / 1200)) - known)
    assert np.median(error_m) < 0.35 * np.median(shifted_m)


def test_pixel_is_point_bounds_half_a_cell_outside_the_degree_do_not_move_the_posts() -> None:
    grid = read("N46E008.tif")
    assert "Pixel-is-point" in sentences(*grid.provenance.conversions)
    with rasterio.open(SHARED_DEMS / "N46E008.tif") as dataset:
        posts = dataset.read(1)
    # the post nearest to 8.5 E 46.5 N is number 600, 600 of the file
    here = float(height_at(grid, *to_grid_frame(grid, 8.5, 46.5)))
    assert here == pytest.approx(float(posts[600, 600]), abs=15.0)


def test_srtm_voids_stay_unknown_and_never_bleed_into_heights() -> None:
    grid = read("N46E008.tif")
    with rasterio.open(SHARED_DEMS / "N46E008.tif") as dataset:
        posts = dataset.read(1)
    assert (posts == -32767).sum() == 103_743
    known = posts[posts != -32767]
    assert np.nanmin(grid.heights_m) >= known.min()
    assert np.nanmax(grid.heights_m) <= known.max()
    rows, cols = np.nonzero(posts == -32767)
    lon, lat = 8.0 + cols[::50] / 1200.0, 47.0 - rows[::50] / 1200.0
    assert np.isnan(height_at(grid, *to_grid_frame(grid, lon, lat))).all()


def test_mars_keeps_its_negative_heights_without_a_word_and_its_own_radius() -> None:
    grid = read("mmgis_gale_missionDEM.tif")
    assert grid.crs is not None
    assert body_of(grid.crs).name == "Mars"
    assert body_of(grid.crs).radius_m == pytest.approx(3_396_190.0)
    assert np.nanmax(grid.heights_m) < -4430.0
    assert grid.provenance.warnings == ()
    assert to_lon_lat(grid, *grid.position_of(0, 0)) == pytest.approx((137.367, -4.664), abs=0.002)


@pytest.mark.parametrize("name", ["gvi_vancouver_DEM.tif", "gvi_vancouver_DSM.tif"])
def test_nan_declared_as_nodata_is_unknown(name: str) -> None:
    grid = read(name)
    assert grid.unknown_posts == 404
    assert grid.provenance.warnings == ()


def test_horizontal_feet_become_metres_without_resampling() -> None:
    grid = read("viewscape_test_dsm.tif")
    with rasterio.open(SHARED_DEMS / "viewscape_test_dsm.tif") as dataset:
        np.testing.assert_array_equal(grid.heights_m, dataset.read(1))
        file_crs = pyproj.CRS.from_wkt(dataset.crs.to_wkt())
        in_feet = dataset.xy(400, 300)
    assert (grid.cell_east_m, grid.cell_north_m) == pytest.approx((0.6096, 0.6096))
    to_degrees = pyproj.Transformer.from_crs(file_crs, file_crs.geodetic_crs, always_xy=True)
    assert to_lon_lat(grid, *grid.position_of(400, 300)) == pytest.approx(to_degrees.transform(*in_feet), abs=1e-7)
    assert "× 0.3048" in sentences(*grid.provenance.conversions)
    assert "does not say in what its heights are" in sentences(*grid.provenance.warnings)


def test_vertical_feet_can_be_told() -> None:
    metres, feet = read("viewscape_test_dsm.tif"), read("viewscape_test_dsm.tif", height_unit="ft")
    np.testing.assert_allclose(feet.heights_m, metres.heights_m * 0.3048, rtol=1e-6)
    assert feet.provenance.warnings == ()


def test_the_rounded_float32_minimum_is_recognised_as_nodata() -> None:
    grid = read("jancaha_dsm.tif")
    assert grid.unknown_posts == 1035
    assert float(np.nanmin(grid.heights_m)) == pytest.approx(987.27, abs=0.01)


def test_sparse_lidar_keeps_its_holes() -> None:
    grid = read("samp53-utm_dsm1m.tif")
    assert grid.unknown_posts > grid.heights_m.size * 0.8
    assert grid.crs is None
    assert "no CRS" in sentences(*grid.provenance.warnings)


def test_dted_has_its_datum_and_cells_that_are_not_square() -> None:
    grid = read("n43.dt0")
    assert grid.vertical_datum == "mean sea level"
    assert grid.cell_north_m / grid.cell_east_m == pytest.approx(1.0 / np.cos(np.radians(43.5)), rel=0.01)
    with rasterio.open(SHARED_DEMS / "n43.dt0") as dataset:
        posts = dataset.read(1)
    corner = float(height_at(grid, *to_grid_frame(grid, -80.0 + 60 / 120, 44.0 - 60 / 120)))
    assert corner == pytest.approx(float(posts[60, 60]), abs=5.0)


def test_degrees_without_a_crs_are_taken_for_degrees_with_a_warning() -> None:
    grid = read("colorado_srtm3.asc")
    assert grid.crs is not None
    assert grid.crs.to_epsg() == 32613
    assert grid.cell_north_m == pytest.approx(92.5, abs=0.2)
    assert "look like degrees" in sentences(*grid.provenance.warnings)


def test_the_callers_crs_needs_no_guess() -> None:
    grid = read("colorado_srtm3.asc", crs="EPSG:4269")
    assert grid.provenance.warnings == ()
    assert grid.crs is not None
    assert grid.crs.to_epsg() == 26913
    assert read("colorado_srtm3.asc", crs="local").cell_east_m == pytest.approx(1 / 1200)


def test_undeclared_fill_becomes_unknown_with_a_warning_and_a_count() -> None:
    grid = read("landlab_hugo_site_filled.asc")
    assert grid.unknown_posts == 2028
    assert "2,028 posts hold -9999" in sentences(*grid.provenance.warnings)
    assert float(np.nanmin(grid.heights_m)) == 1660.0


def test_nodata_declares_the_fill_and_silences_the_warning_or_keeps_it_as_heights() -> None:
    declared = read("landlab_hugo_site_filled.asc", nodata=-9999.0)
    assert declared.unknown_posts == 2028
    assert "-9999" not in sentences(*declared.provenance.warnings)
    kept = read("landlab_hugo_site_filled.asc", nodata=float("nan"))
    assert kept.unknown_posts == 0
    assert "2,028 posts lie below -500 m" in sentences(*kept.provenance.warnings)


def test_target_crs_is_followed() -> None:
    grid = read("n43.dt0", target_crs="EPSG:32618")
    assert grid.crs is not None
    assert grid.crs.to_epsg() == 32618
    lon, lat = highest(grid)
    assert (lon, lat) == pytest.approx(highest(read("n43.dt0")), abs=0.01)


def test_the_file_can_be_limited() -> None:
    with pytest.raises(DemReadError, match=r"769,671 cells"):
        read("bigtujunga.tif", max_cells=100_000)
