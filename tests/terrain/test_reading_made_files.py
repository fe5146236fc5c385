"""What read_dem does with each thing that a file may say, on files made for it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyproj
import pytest
import rasterio
import rasterio.shutil
from rasterio.enums import ColorInterp

from terrain import ElevationGrid, height_at, read_dem, to_grid_frame, to_lon_lat
from tests.terrain.files import hill, sentences, write_asc, write_tif

DEGREE_TRANSFORM = rasterio.Affine(0.001, 0, 11.9, 0, -0.002, 47.0)


def warnings_of(grid: ElevationGrid) -> str:
    return sentences(*grid.provenance.warnings)


def conversions_of(grid: ElevationGrid) -> str:
    return sentences(*grid.provenance.conversions)


def test_posts_are_cell_centres_and_row_zero_is_north(tmp_path: Path) -> None:
    transform = rasterio.Affine(10, 0, 500_000, 0, -25, 5_000_000)
    grid = read_dem(write_tif(tmp_path / "dem.tif", hill(), transform=transform))
    np.testing.assert_array_equal(grid.heights_m, hill())
    assert grid.position_of(0, 0) == (500_005.0, 4_999_987.5)
    assert (grid.cell_east_m, grid.cell_north_m) == (10.0, 25.0)


def test_pixel_is_point_puts_the_posts_on_the_files_points(tmp_path: Path) -> None:
    # GDAL writes the same bounds either way; the tag moves the tie point, not the ground
    area = read_dem(write_tif(tmp_path / "area.tif", hill(), tags={"AREA_OR_POINT": "Area"}))
    point = read_dem(write_tif(tmp_path / "point.tif", hill(), tags={"AREA_OR_POINT": "Point"}))
    assert area.position_of(0, 0) == point.position_of(0, 0)
    assert "Pixel-is-point" in conversions_of(point)
    assert area.provenance.conversions == ()


@pytest.mark.parametrize(("key", "expected"), [("corner", (105.0, 205.0)), ("center", (100.0, 200.0))])
def test_an_ascii_grid_tells_corner_from_centre(tmp_path: Path, key: str, expected: tuple[float, float]) -> None:
    path = write_asc(tmp_path / "dem.asc", hill())
    path.write_text(path.read_text().replace("corner", key))
    grid = read_dem(path)
    assert grid.position_of(grid.rows - 1, 0) == expected
    np.testing.assert_allclose(grid.heights_m, hill(), atol=1e-3)


def test_a_south_up_file_is_turned(tmp_path: Path) -> None:
    transform = rasterio.Affine(10, 0, 500_000, 0, 10, 4_999_880)
    turned = read_dem(write_tif(tmp_path / "dem.tif", hill()[::-1].copy(), transform=transform))
    straight = read_dem(write_tif(tmp_path / "straight.tif", hill()))
    assert turned.digest == straight.digest
    assert "turned so that row 0 is northmost" in conversions_of(turned)


def test_a_cloud_optimised_geotiff_is_read_like_any_other(tmp_path: Path) -> None:
    heights = np.tile(hill(), (60, 50))
    plain = read_dem(write_tif(tmp_path / "plain.tif", heights))
    with rasterio.open(tmp_path / "plain.tif") as dataset:
        rasterio.shutil.copy(dataset, tmp_path / "cog.tif", driver="COG", compress="deflate")
    assert read_dem(tmp_path / "cog.tif").digest == plain.digest


def test_scale_and_offset_are_applied_to_heights_but_not_to_nodata(tmp_path: Path) -> None:
    counts = np.arange(20, dtype="i2").reshape(4, 5)
    grid = read_dem(write_tif(tmp_path / "dem.tif", counts, nodata=7, scales=(0.1,), offsets=(100.0,)))
    expected = 100.0 + 0.1 * counts
    expected[1, 2] = np.nan
    np.testing.assert_allclose(grid.heights_m, expected, rtol=1e-6)
    assert "× 0.1 + 100" in conversions_of(grid)


@pytest.mark.parametrize(
    ("unit", "metres"), [("m", 1.0), ("metre", 1.0), ("ft", 0.3048), ("Foot", 0.3048), ("US survey foot", 1200 / 3937)]
)
def test_declared_height_units_are_converted(tmp_path: Path, unit: str, metres: float) -> None:
    grid = read_dem(write_tif(tmp_path / "dem.tif", hill(), units=(unit,)))
    np.testing.assert_allclose(grid.heights_m, hill() * metres, rtol=1e-6)
    assert ("to metres" in conversions_of(grid)) == (metres != 1.0)


def test_the_callers_height_unit_overrules_the_files_with_a_warning(tmp_path: Path) -> None:
    grid = read_dem(write_tif(tmp_path / "dem.tif", hill(), units=("ft",)), height_unit="m")
    np.testing.assert_array_equal(grid.heights_m, hill())
    assert "The file says that heights are in ft; height_unit=m was taken" in warnings_of(grid)


def test_a_compound_crs_gives_datum_and_height_unit(tmp_path: Path) -> None:
    grid = read_dem(write_tif(tmp_path / "dem.tif", hill(), crs="EPSG:26911+6360"))
    assert grid.vertical_datum == "NAVD88 height (ftUS)"
    np.testing.assert_allclose(grid.heights_m, hill() * (1200 / 3937), rtol=1e-6)
    assert grid.crs is not None
    assert grid.crs.to_epsg() == 26911


@pytest.mark.parametrize(("code", "metres"), [(2253, 0.3048), (2229, 1200 / 3937)])
def test_feet_on_the_map_keep_every_post_where_it_is(tmp_path: Path, code: int, metres: float) -> None:
    crs = pyproj.CRS.from_epsg(code)
    east_ft, north_ft = pyproj.Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True).transform(
        *{2253: (-84.5, 42.5), 2229: (-118.3, 34.2)}[code]
    )
    transform = rasterio.Affine(3, 0, east_ft, 0, -3, north_ft)
    grid = read_dem(write_tif(tmp_path / "dem.tif", hill(), crs=f"EPSG:{code}", transform=transform))
    np.testing.assert_array_equal(grid.heights_m, hill())
    assert grid.cell_east_m == pytest.approx(3 * metres)
    assert grid.position_of(0, 0) == pytest.approx(((east_ft + 1.5) * metres, (north_ft - 1.5) * metres))
    back = pyproj.Transformer.from_crs(grid.crs, crs.geodetic_crs, always_xy=True).transform(*grid.position_of(7, 9))
    there = pyproj.Transformer.from_crs(crs, crs.geodetic_crs, always_xy=True).transform(
        east_ft + 1.5 + 9 * 3, north_ft - 1.5 - 7 * 3
    )
    assert back == pytest.approx(there, abs=1e-9)


def test_nodata_replaces_what_the_file_declares(tmp_path: Path) -> None:
    heights = hill()
    heights[0, 0], heights[1, 1] = 0.0, -1.0
    path = write_tif(tmp_path / "dem.tif", heights, nodata=0.0)
    assert np.isnan(read_dem(path).heights_m[0, 0])
    swapped = read_dem(path, nodata=-1.0)
    assert swapped.heights_m[0, 0] == 0.0
    assert np.isnan(swapped.heights_m[1, 1])
    assert "no post holds that value" in warnings_of(read_dem(path, nodata=-7.0))


@pytest.mark.parametrize("fill", [-9999.0, -32768.0, -32767.0, 32767.0, -3.4028234663852886e38, 3.4e38, 1e38])
def test_undeclared_fill_is_unknown_with_a_count(tmp_path: Path, fill: float) -> None:
    heights = hill()
    heights[2, 3:6] = fill
    grid = read_dem(write_tif(tmp_path / "dem.tif", heights))
    assert grid.unknown_posts == 3
    assert "3 posts hold" in warnings_of(grid)
    np.testing.assert_array_equal(grid.heights_m[3:], hill()[3:])


@pytest.mark.parametrize(
    ("value", "words"), [(-600.0, "1 posts lie below -500 m"), (9500.0, "1 posts lie above 9000 m"), (-9998.0, "below")]
)
def test_implausible_heights_are_reported_and_kept(tmp_path: Path, value: float, words: str) -> None:
    heights = hill()
    heights[2, 3] = value
    path = write_tif(tmp_path / "dem.tif", heights)
    assert read_dem(path).heights_m[2, 3] == value
    assert words in warnings_of(read_dem(path))
    assert read_dem(path, nodata=value).provenance.warnings == ()


def test_an_integer_file_takes_a_nodata_that_it_cannot_hold(tmp_path: Path) -> None:
    grid = read_dem(write_tif(tmp_path / "dem.tif", hill().astype("u2")), nodata=-9999.5)
    assert grid.unknown_posts == 0
    assert "no post holds that value" in warnings_of(grid)


@pytest.mark.parametrize("dtype", ["u2", "f4"])
def test_an_alpha_band_marks_unknown_ground(tmp_path: Path, dtype: str) -> None:
    alpha = np.full(hill().shape, 65535, dtype)
    alpha[4, 4] = 0
    with_alpha = write_tif(
        tmp_path / "a.tif", np.stack([hill().astype(dtype), alpha]), colorinterp=[ColorInterp.gray, ColorInterp.alpha]
    )
    grid = read_dem(with_alpha)
    assert grid.unknown_posts == 1
    assert grid.provenance.warnings == ()


def test_of_many_bands_the_first_is_taken_with_a_warning(tmp_path: Path) -> None:
    two = read_dem(write_tif(tmp_path / "b.tif", np.stack([hill(), hill() + 9])))
    np.testing.assert_array_equal(two.heights_m, hill())
    assert "2 bands; band 1 was taken" in warnings_of(two)


@pytest.mark.parametrize("dtype", ["u1", "i2", "u2", "i4", "u4", "f4", "f8"])
def test_every_real_type_is_read(tmp_path: Path, dtype: str) -> None:
    heights = (hill() / 4).astype(dtype)
    np.testing.assert_array_equal(read_dem(write_tif(tmp_path / "d.tif", heights)).heights_m, heights.astype("f4"))


def test_a_prj_beside_an_ascii_grid_is_its_crs(tmp_path: Path) -> None:
    path = write_asc(tmp_path / "dem.asc", hill())
    assert read_dem(path).crs is None
    moved = path.read_text().replace("corner 100", "corner 500000").replace("corner 200", "corner 5000000")
    path.write_text(moved)
    path.with_suffix(".prj").write_text(pyproj.CRS.from_epsg(32632).to_wkt("WKT1_ESRI"))
    grid = read_dem(path)
    assert grid.crs is not None
    assert "UTM" in grid.crs.name.replace("_", " ")
    assert "taken from dem.prj" in conversions_of(grid)
    path.with_suffix(".prj").write_text("the map on the kitchen wall\n")
    assert "The file has no CRS" in warnings_of(read_dem(path))


def test_the_callers_crs_overrules_the_files_with_a_warning(tmp_path: Path) -> None:
    grid = read_dem(write_tif(tmp_path / "dem.tif", hill()), crs=32633)
    assert grid.crs is not None
    assert grid.crs.to_epsg() == 32633
    assert "The file says that its CRS is WGS 84 / UTM zone 32N" in warnings_of(grid)


def test_a_small_model_in_metres_is_not_mistaken_for_degrees(tmp_path: Path) -> None:
    path = write_asc(tmp_path / "dem.asc", hill(), cell=0.05)
    path.write_text(path.read_text().replace("corner 100", "corner 0").replace("corner 200", "corner 0"))
    grid = read_dem(path)
    assert grid.crs is None
    assert grid.cell_east_m == pytest.approx(0.05)


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
    east, north = grid.position_of(r, c)  # type: ignore[arg-type]
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
    lons, lats = to_lon_lat(grid, *grid.position_of(r, c))  # type: ignore[arg-type]
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
