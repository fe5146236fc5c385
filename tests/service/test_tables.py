"""Tables open in spreadsheets: a text from outside is never calculated there, and is itself again when it is read."""

import csv
import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.cli.asking.anchor_files import anchors_from_file
from service.files.csv_table import TableWriter, cell_of, text_of_cell

HOSTILE = ["=1+1", "+SUM(A1)", "-2+3", "@cmd", "\t=1", "\r=1", "＝1+1", "'=1+1", "''@x", '=HYPERLINK("http://x")']


@pytest.mark.parametrize("text", HOSTILE)
def test_a_text_that_a_spreadsheet_would_calculate_begins_with_a_quote(text):
    assert cell_of(text) == f"'{text}"


@pytest.mark.parametrize("value", [-1.5, -3, "-12.5", "+4", "-1e-9", "-inf", "D1", "'quoted'", "", None])
def test_numbers_and_plain_texts_stay_as_they_are(value):
    assert cell_of(value) == value


@given(st.text())
def test_reading_gives_every_text_back(text):
    assert text_of_cell(cell_of(text)) == text


def test_a_table_is_csv_whatever_its_cells_hold():
    file = io.StringIO(newline="")
    TableWriter(file).rows(["id", "east_m"], [{"id": '=a"b,c\nd', "east_m": -1.5}, {"id": "D1"}])
    assert list(csv.reader(io.StringIO(file.getvalue(), newline=""))) == [
        ["id", "east_m"],
        ["'=a\"b,c\nd", "-1.5"],
        ["D1", ""],
    ]


@pytest.mark.parametrize("id", ["=1+1", "@x", "'=1", "-2+3", "'", "it's"])
def test_anchors_that_were_written_are_read_with_the_same_id(tmp_path, id):
    path = tmp_path / "anchors.csv"
    with path.open("w", encoding="utf-8", newline="") as file:
        TableWriter(file).rows(
            ["id", "east_m", "north_m", "altitude_m"], [{"id": id, "east_m": 1.0, "north_m": -2.0, "altitude_m": 3.0}]
        )
    (anchor,) = anchors_from_file(path)
    assert (anchor.id, anchor.north_m) == (id, -2.0)
