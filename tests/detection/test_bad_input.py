"""Whatever a sensor delivers, the session answers, counts and goes on; misuse is told at once."""

from __future__ import annotations

import math

import pytest

from detection import Detector, DetectorSettings, RangeEpoch, RangeMeasurement, RangingAnchor, Rejection

ANCHORS = [
    RangingAnchor(name, *place)
    for name, place in {"A": (0, 0, 9), "B": (90, 0, 3), "C": (90, 80, 12), "D": (0, 80, 1), "E": (40, 30, 20)}.items()
]
ROVER = (31.0, 42.0, 1.0)


def epoch(time_s: float, **spoilt: float) -> RangeEpoch:
    ranges_m = {
        anchor.id: math.dist((anchor.east_m, anchor.north_m, anchor.altitude_m), ROVER) for anchor in ANCHORS
    } | spoilt
    return RangeEpoch(time_s, tuple(RangeMeasurement(name, range_m) for name, range_m in ranges_m.items()))


@pytest.mark.parametrize(
    ("range_m", "reason"),
    [
        (-1.0, Rejection.NOT_POSITIVE),
        (0.0, Rejection.NOT_POSITIVE),
        (math.nan, Rejection.NOT_FINITE),
        (math.inf, Rejection.NOT_FINITE),
        (1e12, Rejection.TOO_LONG),
    ],
)
def test_a_range_that_cannot_be_one_is_named_counted_and_left_out(range_m: float, reason: Rejection) -> None:
    detector = Detector(ANCHORS)
    answer = detector.process(epoch(0.0, B=range_m))
    assert [(rejected.anchor_id, rejected.reason) for rejected in answer.rejected] == [("B", reason)]
    assert "B" not in answer.included + answer.excluded
    assert detector.state.rejections == {reason: 1}
    assert detector.process(epoch(1.0)).rejected == ()


def test_epochs_that_come_twice_late_or_out_of_order_are_told_and_counted() -> None:
    detector = Detector(ANCHORS, DetectorSettings(window=3))
    for time_s in range(6):
        assert detector.process(epoch(float(time_s))).rejection is None
    assert detector.process(epoch(5.0)).rejection is Rejection.DUPLICATE
    assert detector.process(epoch(4.5)).rejection is Rejection.OUT_OF_ORDER
    assert detector.process(epoch(0.5)).rejection is Rejection.LATE
    assert detector.process(epoch(math.nan)).rejection is Rejection.BAD_TIME
    assert detector.process(epoch(6.0)).rejection is None
    assert detector.state.epochs == 7
    assert sum(detector.state.rejections.values()) == 4
