"""Drones at one height leave two places: both are followed until a hint or the ranges settle which is the rover's."""

from __future__ import annotations

import numpy as np
import pytest

from detection import Detector, DetectorSettings, RangeEpoch, RangeMeasurement, RangingAnchor
from tests.detection.worlds import DRONES_M, ROVER_M, STEP_M, drive, heard, named, off_m


def level_drones() -> list[RangingAnchor]:
    return [RangingAnchor(f"D{i + 1}", float(e), float(n), 80.0) for i, (e, n, _) in enumerate(DRONES_M[:6])]


def test_level_drones_leave_two_tracks_and_an_epoch_says_both() -> None:
    anchors = level_drones()
    detector = Detector(anchors)
    answer = drive(detector, anchors, range(20))[-1]
    assert answer.position is not None
    assert answer.position.mirror_m is not None
    assert answer.position.position_m[2] == pytest.approx(2.0, abs=0.2)
    assert answer.position.mirror_m[2] == pytest.approx(158.0, abs=0.2)


def test_a_hint_or_a_drone_that_climbs_settles_the_side() -> None:
    anchors = level_drones()
    hinted = Detector(anchors, DetectorSettings(altitude_hint_m=0.0))
    answer = drive(hinted, anchors, range(10))[-1]
    assert answer.position is not None
    assert answer.position.mirror_m is None
    detector = Detector(anchors)
    drive(detector, anchors, range(20))
    climbed = [RangingAnchor("D1", 0.0, 0.0, 120.0), *anchors[1:]]
    ranges = tuple(RangeMeasurement(n, r) for n, r in named(climbed, ROVER_M + 2.0 * STEP_M).items())
    detector.process(RangeEpoch(2.0, ranges, moved=(climbed[0],)))
    answer = drive(detector, climbed, range(21, 40))[-1]
    assert answer.position is not None
    assert answer.position.mirror_m is None
    assert off_m(answer, 39) < 0.2


def test_a_track_that_begins_on_the_wrong_side_of_a_shallow_layer_is_corrected_by_the_ranges() -> None:
    rng = np.random.default_rng(3)
    lost = 0
    for _ in range(12):
        places_m = np.column_stack([DRONES_M[:8, :2] / 60.0, rng.uniform(2.0, 2.8, 8)])
        anchors = [RangingAnchor(f"A{i}", *map(float, place)) for i, place in enumerate(places_m)]
        rover_m, step_m = np.array([2.0, 2.0, 1.3]), np.array([1.0, 0.4, 0.0])
        detector = Detector(anchors)
        for number in range(40):
            place_m = rover_m + 0.07 * number * step_m
            ranges_m = {n: r + 0.1 * rng.normal() for n, r in named(anchors, place_m).items()}
            answer = detector.process(heard(0.07 * number, ranges_m))
        assert answer.position is not None
        lost += np.linalg.norm(answer.position.position_m - place_m) > 0.8
    assert lost == 0
