"""What a file's numbers are as heights: fills and plausibility after scale and unit, units, datums, bands, radii."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio

from terrain import DemReadError, DemUnsupportedError, ElevationGrid, read_dem
from terrain.units import height_unit_of
from tests.terrain.files import hill, sentences, write_asc, write_tif

SURVEY_FOOT_M = 1200.0 / 3937.0
# where EPSG:6529 (New Mexico, US survey feet) lies
NEW_MEXICO = rasterio.Affine(100, 0, 1_650_000, 0, -100, 1_480_000)
MOON = "+proj=eqc +R=1737400 +units=m +no_defs"


def warnings_of(grid: ElevationGrid) -> str:
    return sentences(*grid.provenance.warnings)


@pytest.mark.parametrize(
    ("dtype", "scale", "offset", "low_m", "high_m"),
    [
        ("i4", 0.01, 0.0, 897.0, 1535.0), ("i4", 0.001, 0.0, 897.0, 1535.0), ("u2", 0.1, -1000.0, 2260.0, 2297.5),
        ("i2", 0.5, 0.0, -5100.0, -4900.0), ("i4", 0.1, 0.0, -1200.0, 3500.0), ("u2", 0.01, 0.0, 300.0, 350.0),
    ],
)  # fmt: skip
def test_scaled_integers_are_judged_as_heights(
    tmp_path: Path, dtype: str, scale: float, offset: float, low_m: float, high_m: float
) -> None:
    # every number between, so that every usual fill value that lies there is a height of this ground
    counts = np.arange(round((low_m - offset) / scale), round((high_m - offset) / scale) + 1)
    counts = np.resize(counts, (len(counts) // 50 + 1, 50)).astype(dtype)
    path = write_tif(tmp_path / "dem.tif", counts, scales=(scale,), offsets=(offset,))
    grid = read_dem(path)
    with rasterio.open(path) as dataset:
        np.testing.assert_allclose(grid.heights_m, dataset.read(1) * scale + offset, rtol=1e-6)
    assert grid.unknown_posts == 0
    assert "fill" not in warnings_of(grid)


@pytest.mark.parametrize("fill", [-9999.0, 32767.0, -999_900.0, -2_147_483_648.0])
def test_a_fill_value_apart_from_scaled_heights_is_unknown(tmp_path: Path, fill: float) -> None:
    counts = np.round(hill() * 100.0).astype("i4")
    counts[2, 3:6] = fill
    grid = read_dem(write_tif(tmp_path / "dem.tif", counts, scales=(0.01,)))
    assert grid.unknown_posts == 3
    assert "3 posts hold" in warnings_of(grid)


def test_a_declared_nodata_stands_in_the_files_numbers(tmp_path: Path) -> None:
    counts = np.round(hill() * 100.0).astype("i4")
    counts[2, 3:6] = -999_900
    path = write_tif(tmp_path / "dem.tif", counts, scales=(0.01,), nodata=-999_900)
    assert read_dem(path).unknown_posts == 3
    assert read_dem(path).provenance.warnings == ()
    assert read_dem(path, nodata=float(counts[7, 8])).unknown_posts >= 1


def test_fractional_heights_beside_a_usual_fill_value_are_kept_with_a_word(tmp_path: Path) -> None:
    heights = np.linspace(-9990.0, 5000.0, 400, dtype="f4").reshape(20, 20)
    heights[3, 4] = -9999.0
    grid = read_dem(write_tif(tmp_path / "dem.tif", heights))
    assert grid.unknown_posts == 0
    assert "kept as heights, next to the others (give nodata=-9999 if they are fill)" in warnings_of(grid)
    assert read_dem(tmp_path / "dem.tif", nodata=-9999.0).unknown_posts == 1


def test_plain_integers_keep_their_usual_fill_values(tmp_path: Path) -> None:
    heights = np.full((9, 9), -9000, "i2")
    heights[0], heights[4, 4] = -10_500, -9999
    assert read_dem(write_tif(tmp_path / "dem.tif", heights)).unknown_posts == 1


def test_heights_in_millimetres_that_the_file_does_not_declare_are_told_with_the_way_out(tmp_path: Path) -> None:
    path = write_tif(tmp_path / "dem.tif", (hill() * 1000.0).astype("i4"))
    with pytest.raises(DemUnsupportedError, match=r"beyond ±100,000 m; give height_unit="):
        read_dem(path)
    np.testing.assert_allclose(read_dem(path, height_unit="mm").heights_m, hill(), atol=1e-3)


@pytest.mark.parametrize(("dtype", "scale", "offset"), [("i2", 0.5, 1_737_400.0), ("f4", 1.0, 0.0)])
def test_a_radius_is_taken_off_and_told(tmp_path: Path, dtype: str, scale: float, offset: float) -> None:
    numbers = ((hill() + (0.0 if offset else 1_737_400.0)) / scale).astype(dtype)
    settings: dict[str, Any] = {"crs": MOON, "transform": rasterio.Affine(100, 0, 0, 0, -100, 0)}
    grid = read_dem(write_tif(tmp_path / "dem.tif", numbers, scales=(scale,), offsets=(offset,), **settings))
    np.testing.assert_allclose(grid.heights_m, hill(), atol=0.5)
    assert "distances from the centre of the body; its radius of 1,737,400 m was taken off" in warnings_of(grid)
    assert grid.vertical_datum == "sphere of radius 1,737,400 m"


def test_distances_from_the_centre_of_a_spheroid_are_refused(tmp_path: Path) -> None:
    mars = "+proj=eqc +a=3396190 +b=3376200 +units=m +no_defs"
    with pytest.raises(DemUnsupportedError, match="which is no sphere; take off its ellipsoid"):
        read_dem(write_tif(tmp_path / "dem.tif", hill().astype("f8") + 3.39e6, crs=mars))


@pytest.mark.parametrize(
    ("text", "unit", "above"),
    [
        ("m", "m", None), ("Metre", "m", None), ("METERS", "m", None), ("[m]", "m", None),
        ("m above EGM2008", "m", "EGM2008"),
        ("meters above mean sea level", "m", "mean sea level"), ("metres (NAVD88)", "m", "NAVD88"),
        ("m above WGS84 ellipsoid", "m", "WGS84 ellipsoid"), ("US_survey_foot", "us-ft", None), ("ftUS", "us-ft", None),
        ("U.S. Survey Feet", "us-ft", None), ("foot_us", "us-ft", None), ("ft (US)", "us-ft", None),
        ("us-ft", "us-ft", None),
        ("FEET", "ft", None), ("international foot", "ft", None), ("feet above MSL", "ft", "MSL"), ("cm", "cm", None),
        ("decimetre", "dm", None), ("decimeters", "dm", None), ("millimetres", "mm", None), ("km", "km", None),
    ],
)  # fmt: skip
def test_units_are_understood_as_they_are_usually_spelled(text: str, unit: str, above: str | None) -> None:
    told = height_unit_of(text)
    assert told is not None
    assert (told.name, told.above) == (unit, above)


@pytest.mark.parametrize("text", ["", "  ", "unknown", None, "n/a", "none"])
def test_a_file_may_say_nothing_of_its_unit(text: str | None) -> None:
    assert height_unit_of(text) is None


@pytest.mark.parametrize(
    "text", ["fathom", "m/s", "meters per second", "m x 10", "m * 0.1", "m2", "m^2", "feet squared", "K"]
)
def test_what_is_no_unit_of_heights_is_refused_with_the_way_out(text: str) -> None:
    with pytest.raises(DemUnsupportedError, match="give height_unit= as one of m, ft, us-ft"):
        height_unit_of(text)


def test_the_callers_unit_serves_where_the_files_is_not_understood(tmp_path: Path) -> None:
    path = write_tif(tmp_path / "dem.tif", hill(), units=("fathom",))
    with pytest.raises(DemUnsupportedError, match="'fathom' is not known"):
        read_dem(path)
    grid = read_dem(path, height_unit="m")
    np.testing.assert_array_equal(grid.heights_m, hill())
    assert "heights are in fathom; height_unit=m was taken" in warnings_of(grid)


def test_the_words_of_a_unit_give_the_vertical_datum(tmp_path: Path) -> None:
    assert read_dem(write_tif(tmp_path / "a.tif", hill(), units=("m above EGM2008",))).vertical_datum == "EGM2008"
    ellipsoid = read_dem(write_tif(tmp_path / "b.tif", hill(), units=("m above WGS84 ellipsoid",))).vertical_datum
    assert ellipsoid is not None
    assert ellipsoid.startswith("ellipsoid")


def test_a_given_crs_keeps_its_vertical_part(tmp_path: Path) -> None:
    path = write_tif(tmp_path / "dem.tif", hill(), crs="EPSG:6529", transform=NEW_MEXICO)
    assert "does not say in what its heights are" in warnings_of(read_dem(path))
    grid = read_dem(path, crs="EPSG:6529+6360")
    np.testing.assert_allclose(grid.heights_m, hill() * SURVEY_FOOT_M, rtol=1e-6)
    assert grid.vertical_datum == "NAVD88 height (ftUS)"
    assert "does not say" not in warnings_of(grid)
    metres = read_dem(path, crs="EPSG:6529+6360", height_unit="m")
    np.testing.assert_array_equal(metres.heights_m, hill())


def test_a_given_vertical_part_overrules_the_files_with_warnings(tmp_path: Path) -> None:
    path = write_tif(tmp_path / "dem.tif", hill(), crs="EPSG:32632+3855")
    told = warnings_of(read_dem(path, crs="EPSG:32632+6360"))
    assert "heights are in m; that of crs= was taken" in told
    assert "heights are EGM2008 height; NAVD88 height (ftUS) of crs= was taken" in told
    with pytest.raises(DemUnsupportedError, match="target_crs must have no heights"):
        read_dem(path, target_crs="EPSG:32632+6360")


def test_a_local_frame_in_feet_is_brought_to_metres(tmp_path: Path) -> None:
    hall = 'LOCAL_CS["hall",UNIT["US survey foot",0.3048006096012192],AXIS["x",EAST],AXIS["y",NORTH]]'
    grid = read_dem(write_tif(tmp_path / "dem.tif", hill(), crs=hall))
    assert grid.crs is None
    assert grid.cell_east_m == pytest.approx(10.0 * SURVEY_FOOT_M)
    assert grid.position_of(0, 0) == pytest.approx((500_005 * SURVEY_FOOT_M, 4_999_995 * SURVEY_FOOT_M))
    assert "does not say in what its heights are" in warnings_of(grid)


@pytest.mark.parametrize(("zunits", "metres"), [("FEET", 0.3048), ("METERS", 1.0), ("NO", 1.0), ("100", 0.01)])
def test_the_zunits_of_an_arc_info_prj_are_heeded(tmp_path: Path, zunits: str, metres: float) -> None:
    path = write_asc(tmp_path / "dem.asc", hill())
    moved = path.read_text().replace("corner 100", "corner 500000").replace("corner 200", "corner 4000000")
    path.write_text(moved)
    path.with_suffix(".prj").write_text(
        "Projection    UTM\nZone          17\nDatum         NAD83\nUnits         METERS\n"
        f"Zunits        {zunits}\nParameters\n"
    )
    np.testing.assert_allclose(read_dem(path).heights_m, hill() * metres, atol=1e-3)


def test_the_band_of_the_heights_can_be_chosen(tmp_path: Path) -> None:
    path = write_tif(
        tmp_path / "dem.tif", np.stack([hill() * 0, hill(), hill() * 10]), scales=(1, 1, 0.1), units=("m", "ft", "m")
    )
    assert "Give band= if another holds them" in warnings_of(read_dem(path))
    second, third = read_dem(path, band=2), read_dem(path, band=3)
    np.testing.assert_allclose(second.heights_m, hill() * 0.3048, rtol=1e-6)
    np.testing.assert_allclose(third.heights_m, hill(), rtol=1e-6)
    assert second.provenance.warnings == ()
    with pytest.raises(DemUnsupportedError, match="has 3 bands, from 1, so there is no band 4"):
        read_dem(path, band=4)
    np.save(tmp_path / "dem.npy", hill())
    with pytest.raises(DemReadError, match="holds one array of heights, so it has no band 2"):
        read_dem(tmp_path / "dem.npy", band=2, cell_m=1.0)
