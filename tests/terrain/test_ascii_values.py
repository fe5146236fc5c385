"""An ESRI ASCII grid that does not hold the numbers that it announces is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from terrain import DemFormatError, read_dem
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
