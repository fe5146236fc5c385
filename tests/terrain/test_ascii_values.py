"""An ESRI ASCII grid that does not hold the numbers that it announces is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import rasterio

from terrain import DemFormatError, DemUnsupportedError, read_dem
from tests.terrain.files import hill, write_asc

ASCII_HEAD = "ncols 3\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 30\n"


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ("1500 1501 1502\n1503 1504 1505\n1506 1507\n", "8 values where 3 × 3 = 9 are announced"),
        ("1500 1501 1502\n1503 1505\n1506 1507 1508\n", "8 values where"),
        ("1500 1501 1502\n1503 1504 1505\n1506 1507 1508 1509\n", "10 values where"),
        ("1500 1501 1502\n1503 rock 1505\n1506 1507 1508\n", "'rock' in row 2 is not a number"),
        ("1500 1501 1502\n1503 1504 1505\n1506 1507 15-08", "'15-08' in row 3 is not a number"),
        ("1500 1501 1_502\n1503 1504 1505\n1506 1507 1508\n", "'1_502' in row 1 is not a number"),
        ("1500 -nan 1502\n1503 1504 1505\n1506 1507 1508\n", "'-nan' in row 1 is not a number"),
        ("1500 1501 1502\n1503 1504 1505\n1506 1507 " + "8" * 200_000, "in row 3 is not a number"),
        ("1500 1501 1502\n1503 1504 1505\n1506 1507 1508\n\0\0\0", r"'\\x00\\x00\\x00' in row 4 is not a number"),
        ("  nodata_value -9999\n1 2 3\n4 5 6\n7 8 9\n", "'nodata_value' in row 1 is not a number"),
        ("", "0 values where|damaged or cut short|do not fit"),
    ],
)
def test_an_ascii_grid_that_does_not_hold_what_it_announces_is_damaged(tmp_path: Path, values: str, words: str) -> None:
    path = tmp_path / "dem.asc"
    path.write_text(ASCII_HEAD + values)
    with pytest.raises(DemFormatError, match=words):
        read_dem(path)


def test_values_are_counted_across_the_pieces_in_which_a_long_ascii_grid_is_read(tmp_path: Path) -> None:
    path = write_asc(tmp_path / "dem.asc", hill(150, 200))
    assert read_dem(path).shape == (150, 200)
    text = path.read_text()
    head, last = text.rstrip().rsplit(" ", 1)
    path.write_text(head)
    with pytest.raises(DemFormatError, match="29,999 values where 200 × 150 = 30,000 are announced"):
        read_dem(path)
    path.write_text(f"{head} {last}m")
    with pytest.raises(DemFormatError, match=f"'{last}m' in row 150 is not a number"):
        read_dem(path)


@pytest.mark.parametrize("word", ["nan", "NaN", "4294967295", "99999999999", "-2147483649"])
def test_among_whole_numbers_what_is_none_is_unknown(tmp_path: Path, word: str) -> None:
    # GDAL types such a grid as Int32, and makes 0, 0, -1 and the largest number of these; as Float64 it reads them
    path = tmp_path / "dem.asc"
    path.write_text(f"{ASCII_HEAD}1500 1501 1502\n1503 {word} 1505\n1506 1507 1508\n")
    with rasterio.open(path, DATATYPE="Float64") as dataset:
        as_reals = dataset.read(1)
    heights_m = read_dem(path).heights_m
    assert np.isnan(heights_m[1, 1])
    known = ~np.isnan(heights_m)
    assert known.sum() == 8
    np.testing.assert_array_equal(heights_m[known], as_reals[known])


@pytest.mark.parametrize("word", ["inf", "-inf", "INF"])
def test_among_whole_numbers_infinity_is_refused_as_among_others(tmp_path: Path, word: str) -> None:
    path = tmp_path / "dem.asc"
    path.write_text(f"{ASCII_HEAD}1500 1501 1502\n1503 {word} 1505\n1506 1507 1508\n")
    with pytest.raises(DemUnsupportedError, match="1 infinite heights"):
        read_dem(path)


def test_whole_numbers_stay_whole_so_that_usual_fill_values_are_known_by(tmp_path: Path) -> None:
    path = tmp_path / "dem.asc"
    path.write_text(f"{ASCII_HEAD}-9000 -11000 -9500\n-9600 -9999 -9700\n-9800 -9801 -9802\n")
    assert read_dem(path).unknown_posts == 1
    path.write_text(f"{ASCII_HEAD}NODATA_value 7\n5 6 7\n8 9 10\n11 12 13\n")
    assert np.isnan(read_dem(path).heights_m[0, 2])


@pytest.mark.parametrize(("x_place", "half_x"), [("corner", 15.0), ("center", 0.0)])
@pytest.mark.parametrize(("y_place", "half_y"), [("corner", 10.0), ("center", 0.0)])
def test_each_line_of_the_header_states_the_place_of_its_own_axis(
    tmp_path: Path, x_place: str, half_x: float, y_place: str, half_y: float
) -> None:
    path = tmp_path / "dem.asc"
    path.write_text(
        f"NCOLS 3\nNROWS 4\nXLL{x_place} 500000\nyll{y_place} 5000000\ndx 30\ndy 20\n" + "1 2 3\n4 5 6\n" * 2
    )
    assert read_dem(path).position_of(3, 0) == (500_000.0 + half_x, 5_000_000.0 + half_y)


@pytest.mark.parametrize(
    ("line", "instead", "words"),
    [
        ("cellsize 30", "cellsize thirty", "'thirty' after cellsize in its header is not a number"),
        ("cellsize 30", "cellsize 30\nNODATA_value none", "'none' after nodata_value in its header is not a number"),
        ("cellsize 30", "cellsize 30\ncellsize 90", "its header states cellsize after cellsize"),
        ("yllcorner 0", "yllcorner 0\nyllcenter 15", "its header states yllcenter after yllcorner"),
        ("yllcorner 0\n", "", "does not say where it lies: its header has no yllcorner or yllcenter"),
        ("xllcorner 0\n", "", "does not say where it lies: its header has no xllcorner or xllcenter"),
    ],
)
def test_a_header_from_which_gdal_would_guess_is_refused(tmp_path: Path, line: str, instead: str, words: str) -> None:
    path = tmp_path / "dem.asc"
    assert line in ASCII_HEAD
    path.write_text(ASCII_HEAD.replace(line, instead) + "1 2 3\n4 5 6\n7 8 9\n")
    with pytest.raises(DemFormatError, match=words):
        read_dem(path)
