"""Files of depths are turned: their axis, their CRS or the words of their unit say that numbers count downward."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyproj
import pytest

from terrain import HeightReference, height_reference_of, read_dem
from terrain.units import counts_down
from tests.terrain.files import UTM_32N, hill, sentences, write_asc, write_tif

DEPTHS_BY_PROJ = [
    ("EPSG:5715", "EPSG:5714", "MSL height"),
    ("EPSG:6358", "EPSG:5703", "NAVD88 height (ftUS)"),
    ("EPSG:5612", "EPSG:5705", "Baltic 1977 height"),
    ("EPSG:8051", "EPSG:5714", "MSL height (ft)"),
]


@pytest.mark.parametrize("given", [False, True], ids=["in the file", "crs="])
@pytest.mark.parametrize(("depth", "height", "datum"), DEPTHS_BY_PROJ)
def test_a_vertical_crs_of_depths_is_turned_as_proj_turns_it(
    tmp_path: Path, depth: str, height: str, datum: str, given: bool
) -> None:
    upward = pyproj.Transformer.from_crs(depth, height, always_xy=True)
    expected = np.array([upward.transform(9.0, 45.0, float(value))[2] for value in hill().flat]).reshape(hill().shape)
    compound = f"{UTM_32N}+{depth.removeprefix('EPSG:')}"
    path = write_tif(tmp_path / "dem.tif", hill(), crs=UTM_32N if given else compound)
    grid = read_dem(path, crs=compound if given else None)
    np.testing.assert_allclose(grid.heights_m, expected, rtol=1e-6)
    assert grid.heights_m.max() < 0.0
    assert "count downward (depths); heights are these with the sign turned" in told(grid.provenance.conversions)
    assert grid.vertical_datum == datum
    assert height_reference_of(grid) is HeightReference.SEA_LEVEL


DOWN_AXES = [
    'VERT_CS["MSL (depth)",VERT_DATUM["Mean Sea Level",2005],UNIT["metre",1],AXIS["Down",DOWN]]',
    pyproj.CRS.from_epsg(5715).to_wkt("WKT1_ESRI"),
]


@pytest.mark.parametrize("vertical", DOWN_AXES, ids=["OGC", "ESRI"])
def test_an_axis_that_points_down_is_turned(tmp_path: Path, vertical: str) -> None:
    crs = f'COMPD_CS["depths",{pyproj.CRS.from_user_input(UTM_32N).to_wkt("WKT1_GDAL")},{vertical}]'
    grid = read_dem(write_tif(tmp_path / "dem.tif", hill()), crs=crs)
    np.testing.assert_array_equal(grid.heights_m, -hill())
    assert grid.vertical_datum is not None
    assert "depth" not in grid.vertical_datum.lower()


def test_a_prj_beside_an_ascii_grid_may_say_that_it_holds_depths(tmp_path: Path) -> None:
    path = write_asc(tmp_path / "dem.asc", hill())
    path.with_suffix(".prj").write_text(pyproj.CRS.from_user_input(f"{UTM_32N}+5715").to_wkt("WKT1_ESRI"))
    path.write_text(path.read_text().replace("corner 100", "corner 500000").replace("corner 200", "corner 4000000"))
    np.testing.assert_allclose(read_dem(path).heights_m, -hill(), atol=1e-3)


@pytest.mark.parametrize(
    ("unit", "sign", "datum"),
    [
        ("metres below sea level", -1, "sea level"), ("m (depth)", -1, None), ("m depth below LAT", -1, "LAT"),
        ("metre, positive down", -1, None), ("m_below_MSL", -1, "MSL"), ("m above MSL", 1, "MSL"),
        ("m, negative below sea level", 1, "sea level"), ("m (height)", 1, None), ("m", 1, None),
    ],
)  # fmt: skip
def test_the_words_of_a_unit_say_which_way_numbers_count(
    tmp_path: Path, unit: str, sign: int, datum: str | None
) -> None:
    grid = read_dem(write_tif(tmp_path / "dem.tif", hill(), units=(unit,)))
    np.testing.assert_array_equal(grid.heights_m, sign * hill())
    assert grid.vertical_datum == datum


def test_depths_in_feet_with_a_scale_and_a_fill_value(tmp_path: Path) -> None:
    counts = np.arange(-10, 10, dtype="i2").reshape(4, 5)
    counts[0, 0] = -9999
    path = write_tif(tmp_path / "dem.tif", counts, nodata=-9999, scales=(0.1,), offsets=(5.0,), units=("ft (depth)",))
    heights_m = read_dem(path).heights_m
    expected = -(counts * 0.1 + 5.0) * 0.3048
    expected[0, 0] = np.nan
    np.testing.assert_allclose(heights_m, expected, rtol=1e-6)


def test_a_depth_of_zero_is_plain_zero(tmp_path: Path) -> None:
    heights_m = read_dem(write_tif(tmp_path / "dem.tif", np.zeros((3, 3), "f4"), units=("m (depth)",))).heights_m
    assert not np.signbit(heights_m).any()


def test_the_callers_word_on_the_direction_goes_before_the_files(tmp_path: Path) -> None:
    path = write_tif(tmp_path / "dem.tif", hill(), crs=f"{UTM_32N}+5715")
    grid = read_dem(path, crs=f"{UTM_32N}+5714")
    np.testing.assert_array_equal(grid.heights_m, hill())
    assert "do not agree on whether heights count up or down: upward was taken" in told(grid.provenance.warnings)
    np.testing.assert_array_equal(read_dem(path, height_unit="m").heights_m, -hill())
    unread = write_tif(tmp_path / "fathoms.tif", hill(), units=("fathoms below the surface",))
    np.testing.assert_array_equal(read_dem(unread, height_unit="m").heights_m, -hill())


def test_words_that_say_neither_or_both_say_nothing() -> None:
    assert [counts_down(text) for text in (None, "", "m", "m above or below", "upset", "downtown")] == [None] * 6


def told(texts: tuple[str, ...]) -> str:
    return sentences(*texts)
