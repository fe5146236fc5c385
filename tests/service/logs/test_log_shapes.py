"""One drive in the shapes in which logs come: each is read without a word, to the ranges that were driven."""

from __future__ import annotations

import json
import math

import pytest

from service.errors import RequestError
from service.files.logs.form import read_map
from service.files.logs.messages import number_at
from service.files.logs.opening import open_messages
from service.live.epoch_logs import read_epochs
from service.live.log_survey import survey_log
from tests.service.logs.drive import ANCHORS, RANGES, SECONDS, place_m
from tests.service.logs.recorded import RECORDED
from tests.service.logs.tables import TABLES

SHAPES = {**TABLES, **RECORDED}
MEASURED = {(t, str(a)): r for t, a, r in RANGES}
RANGE_M = 0.006  # half of what a centimetre and a float of 32 bits leave


def read(path, **options):
    return read_epochs(path, anchor_ids=[str(anchor) for anchor in ANCHORS], **options)


def ranges_of(log):
    """By the second since the first and the anchor."""
    begin_s = log.epochs[0].time_s
    return {(round(epoch.time_s - begin_s), one.anchor_id): one.range_m for epoch in log.epochs for one in epoch.ranges}


@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_is_read_without_a_word(tmp_path, shape):
    log = read(SHAPES[shape](tmp_path / "log"))
    found = ranges_of(log)
    assert found.keys() == MEASURED.keys()
    assert max(abs(found[key] - MEASURED[key]) for key in MEASURED) < RANGE_M
    assert len(log.epochs) == SECONDS
    assert all(len(epoch.ranges) == len(ANCHORS) for epoch in log.epochs)


@pytest.mark.parametrize("shape", SHAPES)
def test_the_mapping_that_a_log_tells_reads_it_the_same(tmp_path, shape):
    path = SHAPES[shape](tmp_path / "log")
    survey = survey_log([path], anchor_ids=[str(anchor) for anchor in ANCHORS])
    assert survey.ranges == {str(anchor): SECONDS for anchor in ANCHORS}
    assert survey.problem == ""
    if shape in ("lines of JSON", "one file for each anchor"):
        return  # nothing is mapped in the one, and each of the others has its own
    (tmp_path / "map.json").write_text(json.dumps(survey.document()["mapping"]))
    again = read_epochs(path, form=read_map(tmp_path / "map.json"))
    assert repr(again.epochs) == repr(read(path).epochs)


@pytest.mark.parametrize(
    ("shape", "north"),
    [
        ("ROS 1 bag", False),
        ("ROS 2 bag, a topic for each anchor", False),
        ("telemetry, RANGING_BEACON", False),
        ("DataFlash", False),
        ("PX4 ULog, ranging_beacon", True),
    ],
)
def test_the_motion_between_epochs_is_as_long_as_it_was(tmp_path, shape, north):
    log = read(SHAPES[shape](tmp_path / "log"))
    way_m = math.dist(place_m(0), place_m(1))
    for epoch in log.epochs[1:]:
        assert epoch.odometry is not None
        assert math.hypot(*epoch.odometry.wheel_m) == pytest.approx(way_m, rel=0.02)
        assert epoch.odometry.duration_s == pytest.approx(1.0)
        if north:
            assert epoch.odometry.heading_rad == pytest.approx(math.atan2(3.0, 2.0), abs=1e-4)
        else:
            assert epoch.odometry.heading_rad is None


def test_a_header_s_stamp_counts_before_the_time_of_recording(tmp_path):
    log = read(RECORDED["ROS 2 file, a message of one's own"](tmp_path / "log"))
    assert log.epochs[0].time_s == pytest.approx(1_715_767_200.0, abs=1e-3)


def test_what_was_recognised_is_told(tmp_path):
    told = " ".join(read(TABLES["truth and limits beside"](tmp_path / "log")).warnings)
    assert "'t' for time_s, 'to_id' for anchor_id, 'range' for range_m, 'range_std' for sigma_m" in told
    assert "passed over: from_id, gt_range" in told
    told = " ".join(read(RECORDED["PX4 ULog, ranging_beacon"](tmp_path / "px4")).warnings)
    assert "Taken for ranges: ranging_beacon." in told
    assert "vehicle_local_position is an estimate of the autopilot" in told


def test_a_damaged_bag_is_named_without_the_folder_that_holds_it(tmp_path):
    path = tmp_path / "drive.db3"
    path.write_bytes(b"SQLite format 3\0" + bytes(90))
    with pytest.raises(RequestError, match="The log drive") as refused:
        open_messages(path)
    assert str(tmp_path) not in str(refused.value)


@pytest.mark.parametrize(
    ("time", "seconds"),
    [
        ({"sec": 12, "nanosec": 500_000_000}, 12.5),
        ({"secs": 12, "nsecs": 250_000_000}, 12.25),
        ({"sec": None, "nanosec": 5}, None),
        ({"sec": "soon"}, None),
        ({"sec": 12, "nanosec": []}, None),
        ({"sec": {"sec": 1}}, None),
    ],
)
def test_a_time_of_ros_whose_parts_are_no_numbers_is_no_number(time: dict[str, object], seconds: float | None) -> None:
    assert number_at({"header": {"stamp": time}}, "header.stamp") == seconds
