"""Faults of single anchors are named with their size, occlusion is not; what is sent again is known."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from detection import Cause, Detector, Rejection
from tests.detection.test_diagnosis import HALL, SPACE, anchors_at, suspected, walk


def test_two_swapped_ids_are_named() -> None:
    told = {**HALL, "A1": HALL["A6"], "A6": HALL["A1"]}
    (found,) = suspected(anchors_at(told), walk(HALL))
    assert (found.cause, found.anchor_ids) == (Cause.SWAPPED, ("A1", "A6"))
    assert found.value == pytest.approx(math.dist(HALL["A1"], HALL["A6"]))
    assert "are the two ids swapped?" in found.sentence


@pytest.mark.parametrize("shift_m", [(-3.0, 2.0, 0.0), (0.0, 0.0, 4.0), (-1.0, 0.5, 0.0)])
def test_an_anchor_that_stands_elsewhere_is_named_with_the_place(shift_m: tuple[float, float, float]) -> None:
    told = {**HALL, "A3": tuple(a + b for a, b in zip(HALL["A3"], shift_m, strict=True))}
    (found,) = suspected(anchors_at(told), walk(HALL, 400))
    assert (found.cause, found.anchor_ids) == (Cause.MOVED, ("A3",))
    assert found.value == pytest.approx(math.hypot(*shift_m), abs=0.1)
    assert 0.0 < found.sigma < 0.1
    east_m, north_m = HALL["A3"][:2]
    assert f"about east {east_m:.1f}, north {north_m:.1f}" in found.sentence.replace("-0.0", "0.0")


def test_an_anchor_whose_ranges_are_short_throughout_is_named() -> None:
    epochs = [
        replace(epoch, ranges=tuple(replace(r, range_m=r.range_m - 0.8 * (r.anchor_id == "A5")) for r in epoch.ranges))
        for epoch in walk(HALL, 200)
    ]
    (found,) = suspected(anchors_at(HALL), epochs)
    assert (found.cause, found.anchor_ids) == (Cause.ANCHOR_OFFSET, ("A5",))
    assert found.value == pytest.approx(-0.8, abs=0.05)


def test_an_anchor_that_is_occluded_all_the_time_is_not_accused() -> None:
    epochs = [
        replace(epoch, ranges=tuple(replace(r, range_m=r.range_m + 2.0 * (r.anchor_id == "A5")) for r in epoch.ranges))
        for epoch in walk(HALL, 200)
    ]
    assert suspected(anchors_at(HALL), epochs) == ()


def test_an_epoch_that_is_sent_again_is_a_duplicate_however_often() -> None:
    detector, epochs = Detector(anchors_at(HALL), SPACE), walk(HALL)
    for epoch in epochs:
        detector.process(epoch)
    before = detector.state
    # ten old epochs in order would be a clock that was set back
    again = [detector.process(epoch) for epoch in epochs[-30:]]
    assert {one.rejection for one in again} == {Rejection.DUPLICATE}
    assert detector.state.position_m == before.position_m
    assert detector.state.epochs == before.epochs
    set_back = [replace(one, ranges=one.ranges[::-1]) for one in epochs[:12]]
    assert [detector.process(epoch).rejection is None for epoch in set_back] == [False] * 9 + [True] * 3
