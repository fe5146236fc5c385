"""A track that follows a phantom is told and replaced; a good one outlives anchors that are occluded alike."""

from __future__ import annotations

import math

import numpy as np
import pytest

from detection import Detector, DetectorSettings, PlanningStatus
from tests.detection.worlds import ROVER_M, drive, drones, heard, named, off_m


@pytest.mark.parametrize("noise_m", [0.0, 0.1])
def test_a_track_that_began_at_a_wrong_place_is_replaced_while_an_anchor_stays_occluded(noise_m: float) -> None:
    """Four ranges, one of them too long, meet 13 m off; with all six it is plain which."""
    anchors, rng = drones(6), np.random.default_rng(1)
    hinted = DetectorSettings(range_sigma_m=0.1, max_speed_m_per_s=3.0, altitude_hint_m=0.0)
    detector = Detector(anchors, hinted)
    for second in range(60):
        ranges_m = {name: r + noise_m * rng.normal() for name, r in named(anchors, ROVER_M, {"D3": 5.0}).items()}
        if second == 0:
            ranges_m = {name: ranges_m[name] for name in ("D2", "D3", "D4", "D6")}
        answer = detector.process(heard(float(second), ranges_m))
        assert answer.position is not None
        off = math.dist(answer.position.position_m, ROVER_M)
        if second >= 8:
            assert off < 1.0
            assert "D3" in answer.excluded
            assert answer.position.checked
        elif second > 0 and off > 1.0:
            assert answer.planning is PlanningStatus.UNCHECKED


def test_a_track_that_most_ranges_contradict_is_not_checked() -> None:
    anchors = drones(6)
    detector = Detector(anchors)
    drive(detector, anchors, range(30))
    hidden = drive(detector, anchors, range(30, 40), {"D1": 2.0, "D2": 3.5, "D3": 5.0, "D4": 1.5})
    assert {answer.planning for answer in hidden} == {PlanningStatus.UNCHECKED}
    clear = drive(detector, anchors, range(40, 50))
    assert clear[-1].planning is PlanningStatus.CHECKED


def test_a_good_track_outlives_anchors_that_are_occluded_alike() -> None:
    """Three drones on one side, all too long by as much: some others meet elsewhere with them in passing."""
    anchors = drones(8)
    detector = Detector(anchors)
    drive(detector, anchors, range(30), noise=np.random.default_rng(2))
    hidden = {"D2": 2.0, "D3": 2.0, "D7": 2.0}
    answers = drive(detector, anchors, range(30, 130), hidden, noise=np.random.default_rng(3))
    assert max(off_m(answer, 30 + k) for k, answer in enumerate(answers)) < 0.6
    assert sum(set(answer.excluded) == set(hidden) for answer in answers) >= 90
