"""Rows of a log become epochs: by equal time or within a while, with the motion until their last range."""

import math

import pytest
from service.live.epoch_logs import epochs_of, read_epochs

from detection import OdometryIncrement, RangeEpoch, RangeMeasurement, RangingAnchor
from service.errors import RequestError
from service.files.range_log import COLUMNS, read_range_log


def rows_of(tmp_path, *lines):
    path = tmp_path / "log.csv"
    path.write_text("\n".join([",".join(COLUMNS), *lines, ""]), encoding="utf-8")
    return read_range_log(path).rows


def times_and_anchors(epochs):
    return [(epoch.time_s, "".join(measured.anchor_id for measured in epoch.ranges)) for epoch in epochs]


def ranges(*pairs):
    return [f"{time_s},{anchor},5,,,,,,,,," for time_s, anchor in pairs]


def test_ranges_of_equal_time_are_an_epoch(tmp_path):
    rows = rows_of(tmp_path, *ranges((1, "A"), (1, "B"), (2, "A"), (2, "A"), (1, "B")))
    assert times_and_anchors(epochs_of(rows)) == [(1.0, "AB"), (2.0, "AA"), (1.0, "B")]


def test_ranges_within_a_while_are_an_epoch_until_an_anchor_comes_again(tmp_path):
    rows = rows_of(tmp_path, *ranges((1.0, "A"), (1.1, "B"), (1.2, "A"), (1.5, "B"), (1.9, "C"), (0.5, "D")))
    assert times_and_anchors(epochs_of(rows, 0.5)) == [(1.1, "AB"), (1.5, "AB"), (1.9, "C"), (0.5, "D")]


def test_a_range_keeps_its_own_time_sigma_and_prior(tmp_path):
    (epoch,) = epochs_of(rows_of(tmp_path, "1.0,A,5,0.2,0.9,,,,,,,", "1.1,B,nan,,,,,,,,,"), 0.5)
    assert epoch.ranges[0] == RangeMeasurement("A", 5.0, 0.2, 0.9, 1.0)
    assert math.isnan(epoch.ranges[1].range_m)


def test_motions_add_up_as_vectors_until_the_last_range_of_the_epoch(tmp_path):
    rows = rows_of(
        tmp_path,
        "1,A,5,,,,,,,,,",
        "1.5,,,,,0.5,1,0,1,0,0.5,0",
        "2,A,5,,,,,,,,,",
        "2,,,,,0.5,0,2,0,2,0.5,90",  # logged after the range of its own time
        "2.5,,,,,0.5,3,0,3,0,0,0",
        "3,A,5,,,,,,,,,",
    )
    first, second, third = epochs_of(rows)
    assert first.odometry is None
    assert second.odometry == OdometryIncrement(1.0, (1.0, 2.0), (1.0, 2.0, 1.0), math.atan2(2.0, 1.0))
    assert third.odometry == OdometryIncrement(0.5, (3.0, 0.0), (3.0, 0.0, 0.0), 0.0)


def test_what_one_motion_lacks_the_sum_lacks(tmp_path):
    rows = rows_of(tmp_path, "0.5,,,,,0.5,1,0,,,,", "1,,,,,0.5,1,0,1,0,0,45", "1,A,5,,,,,,,,,")
    (epoch,) = epochs_of(rows)
    assert epoch.odometry == OdometryIncrement(1.0, (2.0, 0.0))


@pytest.mark.parametrize("epoch_s", [0.0, 1.0])
def test_a_log_of_motions_alone_has_no_epochs(tmp_path, epoch_s):
    assert epochs_of(rows_of(tmp_path, "0.5,,,,,0.5,1,0,,,,"), epoch_s) == []


def epochs_from(tmp_path, name, text, epoch_s=0.0):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return read_epochs(path, epoch_s).epochs


LONG = """time_s,anchor_id,range_m,sigma_m,p_sight,duration_s,wheel_x_m,wheel_y_m,heading_deg
1,A,5,0.2,,,,,
1,B,6,,0.9,,,,
2,,,,,1,0.5,0,90
2,A,5.5,0.2,,,,,
3,,,,,1,0.5,0,90
3,A,nan,0.2,,,,,
3,B,7,,0.1,,,,
"""
WIDE = """time_s,range_m.A,range_m.B,sigma_m.A,p_sight.B,duration_s,wheel_x_m,wheel_y_m,heading_deg
1,5,6,0.2,0.9,,,,
2,5.5,,0.2,,1,0.5,0,90
3,nan,7,0.2,0.1,1,0.5,0,90
"""


def test_a_moment_a_row_says_the_same_as_a_range_a_row(tmp_path):
    long = epochs_from(tmp_path, "long.csv", LONG)
    wide = epochs_from(tmp_path, "wide.csv", WIDE)
    assert [len(epoch.ranges) for epoch in long] == [2, 1, 2]
    assert repr(wide) == repr(long)  # nan is not nan


@pytest.mark.parametrize("delimiter", [";", "\t"])
@pytest.mark.parametrize("text", [LONG, WIDE], ids=["long", "wide"])
def test_semicolons_and_tabs_separate_cells_as_commas_do(tmp_path, text, delimiter):
    with_commas = epochs_from(tmp_path, "log.csv", text)
    assert repr(epochs_from(tmp_path, "log.csv", text.replace(",", delimiter))) == repr(with_commas)


def test_a_line_of_json_is_an_epoch_as_a_stream_takes_it(tmp_path):
    lines = (
        '{"time_s": 1.0, "sequence": 7, "ranges": [{"anchor_id": "A", "range_m": null}]}',
        "",
        '{"time_s": 2.0, "ranges": [], "odometry": {"duration_s": 1.0, "wheel_m": [0.5, 0.0]}, '
        '"moved": [{"id": "A", "east_m": 1.0, "north_m": 2.0, "altitude_m": 3.0}]}',
    )
    first, second = epochs_from(tmp_path, "log.jsonl", "\n".join(lines))
    assert (first.sequence, first.ranges[0].anchor_id) == (7, "A")
    assert math.isnan(first.ranges[0].range_m)
    assert second == RangeEpoch(2.0, (), OdometryIncrement(1.0, (0.5, 0.0)), None, (RangingAnchor("A", 1.0, 2.0, 3.0),))


BAD_FILES = {
    "wide.csv, line 2: time_s is missing": "time_s,range_m.A\n,5\n",
    "no column 'range_m.B'": "time_s,range_m.A,sigma_m.B\n",
    "unknown column 'anchor_id'": "time_s,anchor_id,range_m.A\n",
    "has the column 'range_m.A' twice": "time_s,range_m.A,range_m.A\n",
    "line 3: range_m.A is 'far', not a number": "time_s,range_m.A\n1,5\n2,far\n",
    "line 2: a motion needs duration_s": "time_s,range_m.A,duration_s,wheel_x_m,wheel_y_m\n1,5,,1,0\n",
}


@pytest.mark.parametrize("sentence", BAD_FILES)
def test_a_wide_log_that_is_none_is_told_in_a_sentence(tmp_path, sentence):
    with pytest.raises(RequestError, match=sentence):
        epochs_from(tmp_path, "wide.csv", BAD_FILES[sentence])


def test_lines_that_are_no_epochs_are_told_with_their_number(tmp_path):
    good = '{"time_s": 1.0, "ranges": []}'
    with pytest.raises(RequestError, match=r"log\.jsonl, line 2: .*Invalid JSON"):
        epochs_from(tmp_path, "log.jsonl", f"{good}\nnonsense\n")
    with pytest.raises(RequestError, match=r"log\.jsonl, line 1: rangs: this field is not known here"):
        epochs_from(tmp_path, "log.jsonl", good.replace("}", ', "rangs": []}'))
    with pytest.raises(RequestError, match="--epoch is for CSV"):
        epochs_from(tmp_path, "log.jsonl", good, epoch_s=0.5)
    with pytest.raises(RequestError, match="cannot be read"):
        read_epochs(tmp_path / "none.jsonl")
    (tmp_path / "latin.jsonl").write_bytes(b"\xff\xfe")
    with pytest.raises(RequestError, match="is not UTF-8 text"):
        read_epochs(tmp_path / "latin.jsonl")
