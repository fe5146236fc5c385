"""Rows of a log become epochs: by equal time or within a while, with the motion until their last range."""

import math

import pytest

from detection import OdometryIncrement, RangeMeasurement
from service.range_log import COLUMNS, epochs_of, read_range_log


def rows_of(tmp_path, *lines):
    path = tmp_path / "log.csv"
    path.write_text("\n".join([",".join(COLUMNS), *lines, ""]), encoding="utf-8")
    return read_range_log(path)


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
