"""What read_dem does with each thing that a file may say, on files made for it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyproj
import pytest
import rasterio
import rasterio.shutil
from rasterio.enums import ColorInterp

from terrain import ElevationGrid, read_dem
from tests.terrain.files import hill, sentences, write_asc, write_tif


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
    "text",
    [
        "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 30\n1 2 3\n4 5 6",
        "NCOLS 3\r\nNROWS 2\r\nXLLCENTER 15\r\nYLLCENTER 15\r\nCELLSIZE 30\r\nNODATA_value -9999\r\n1 2 3\r\n4 5 6\r\n",
        "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ndx 30\ndy 30\nnodata_value nan\n1 2\n3 4\n\n5\n 6 \n",
        "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 30\n 1,0 2e0 +3\t4. 5 6.0E+0\n\n",
        "ncols 3\rnrows 2\rxllcorner 0\ryllcorner 0\rcellsize 30\r1 2 3\r4 5 6\r",
    ],
    ids=["five lines", "CRLF and centres", "dx, dy and wrapped", "commas and exponents", "CR"],
)
def test_an_ascii_grid_may_have_any_usual_header_and_be_wrapped_anyhow(tmp_path: Path, text: str) -> None:
    path = tmp_path / "dem.asc"
    path.write_bytes(text.encode())
    np.testing.assert_array_equal(read_dem(path).heights_m, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])


def test_no_number_is_unknown_ground_in_an_ascii_grid(tmp_path: Path) -> None:
    path = tmp_path / "dem.asc"
    path.write_text("ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 30\nnan 2.0 NaN\n1.#QNAN 5 6\n")
    assert read_dem(path).unknown_posts == 3
