"""What ranges are off is estimated with a sigma that holds, and is applied only by whoever asks."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from detection import Calibration, DetectionInputError, Detector, RangeEpoch, RangeMeasurement, calibrate
from tests.detection.test_diagnosis import HALL, SPACE, anchors_at, changed, walk

OWN_M = {"A0": 0.3, "A1": -0.2, "A2": 0.0, "A3": 0.5, "A4": 0.1, "A5": -0.4, "A6": 0.2, "A7": 0.0}


def with_own(epochs: list[RangeEpoch]) -> list[RangeEpoch]:
    return [
        replace(epoch, ranges=tuple(replace(r, range_m=r.range_m + OWN_M[r.anchor_id]) for r in epoch.ranges))
        for epoch in epochs
    ]


def test_an_offset_and_a_scale_come_with_sigmas_that_hold() -> None:
    offset = calibrate(anchors_at(HALL), changed(walk(HALL, 200), lambda r: r + 0.5), SPACE, "offset")
    assert offset is not None
    assert set(offset.offsets_m) == set(HALL)
    assert abs(offset.offsets_m["A3"] - 0.5) < 4.0 * offset.offset_sigmas_m["A3"] < 0.05
    scale = calibrate(anchors_at(HALL), changed(walk(HALL, 200), lambda r: 1.07 * r), SPACE, "scale")
    assert scale is not None
    assert abs(scale.scale - 1.07) < 4.0 * scale.scale_sigma < 0.01


def test_each_anchor_has_an_offset_of_its_own() -> None:
    found = calibrate(anchors_at(HALL), with_own(walk(HALL, 240)), SPACE, "anchors")
    assert found is not None
    for anchor_id, own_m in OWN_M.items():
        assert abs(found.offsets_m[anchor_id] - own_m) < 4.0 * found.offset_sigmas_m[anchor_id] < 0.3


def test_a_clean_log_has_none() -> None:
    for what in ("offset", "anchors"):
        found = calibrate(anchors_at(HALL), walk(HALL, 240), SPACE, what)
        assert found is not None
        for anchor_id, offset_m in found.offsets_m.items():
            assert abs(offset_m) < 4.0 * found.offset_sigmas_m[anchor_id]


def test_what_was_found_is_applied_when_asked() -> None:
    epochs = with_own(walk(HALL, 240))
    found = calibrate(anchors_at(HALL), epochs, SPACE, "anchors")
    assert found is not None
    plain, mended = Detector(anchors_at(HALL), SPACE), Detector(anchors_at(HALL), SPACE)
    clear = [0, 0]
    for epoch in epochs:
        for number, result in enumerate((plain.process(epoch), mended.process(found.applied(epoch)))):
            clear[number] += sum(verdict.sight == "clear" for verdict in result.verdicts)
    assert clear[1] > 0.95 * 8 * 240
    assert clear[0] < 0.75 * 8 * 240


def test_ranges_that_tell_nothing_are_told_so() -> None:
    three = [replace(epoch, ranges=epoch.ranges[:3]) for epoch in walk(HALL)]
    assert calibrate(anchors_at(HALL), three, SPACE, "anchors") is None
    # from one place a few offsets more are as good as another place
    standing = [replace(epoch, ranges=walk(HALL, 1)[0].ranges) for epoch in walk(HALL)]
    assert calibrate(anchors_at(HALL), standing, SPACE, "anchors") is None


def test_applied_is_the_inverse_of_what_ranges_are() -> None:
    calibration = Calibration(1.02, 0.0, {"A": 0.3})
    (there, strange) = calibration.applied(
        RangeEpoch(0.0, (RangeMeasurement("A", 1.02 * 50.0 + 0.3), RangeMeasurement("B", 51.0)))
    ).ranges
    assert there.range_m == pytest.approx(50.0)
    assert strange.range_m == pytest.approx(50.0)
    for wrong in (0.0, -1.0, math.nan):
        with pytest.raises(DetectionInputError):
            Calibration(wrong)
    with pytest.raises(DetectionInputError):
        Calibration(offsets_m={"A": np.inf})
