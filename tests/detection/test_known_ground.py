"""A rover that stands on known ground: one range more to the epoch, a height that is never surer than the ground is."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from detection import (
    Detector,
    DetectorSettings,
    GroundHeight,
    PlanningStatus,
    RangeEpoch,
    RangingAnchor,
    Rejection,
    detect_epoch,
    meeting_place,
)
from tests.detection.worlds import DRONES_M, Floats, drones, heard, named

ROVER_M = np.array([150.0, 160.0, 2.0])
SETTINGS = DetectorSettings(range_sigma_m=0.05)
# six far off at one height: they hardly tell the rover's
LEVEL = [
    RangingAnchor(f"F{n}", 4000.0 * math.sin(n * math.pi / 3.0), 4000.0 * math.cos(n * math.pi / 3.0), 15.0)
    for n in range(6)
]


def ground(place_m: Floats = ROVER_M, sigma_m: float = 0.5, off_m: float = 0.0) -> GroundHeight:
    """Level where it is told; it rises by 1 in 10 to the east."""
    return GroundHeight(place_m[0] + 5.0, place_m[1], place_m[2] + 0.5 + off_m, 0.1, 0.0, sigma_m)


def noisy(anchors: list[RangingAnchor], second: int, place_m: Floats = ROVER_M) -> RangeEpoch:
    ranges_m = named(anchors, place_m)
    draw = np.random.default_rng(second)
    return heard(float(second), {name: r + 0.05 * float(draw.standard_normal()) for name, r in ranges_m.items()})


def test_three_ranges_and_the_ground_check_one_another() -> None:
    alone = heard(0.0, named(drones(3), ROVER_M))
    assert detect_epoch(drones(3), alone, SETTINGS).planning is not PlanningStatus.CHECKED
    fix = detect_epoch(drones(3), replace(alone, ground=ground()), SETTINGS).position
    assert fix is not None
    assert fix.mirror_m is None
    assert np.linalg.norm(fix.position_m - ROVER_M) < 0.1


def test_ground_settles_which_of_five_ranges_lies() -> None:
    epoch = heard(0.0, named(drones(5), ROVER_M, {"D4": 6.0}))
    result = detect_epoch(drones(5), replace(epoch, ground=ground()), SETTINGS)
    assert result.excluded == ("D4",)
    assert len(result.verdicts) == 5


def test_ground_is_left_out_where_all_ranges_meet_elsewhere() -> None:
    epoch = heard(0.0, named(drones(), ROVER_M))
    result = detect_epoch(drones(), replace(epoch, ground=ground(off_m=60.0)), SETTINGS)
    assert result.excluded == ()
    assert result.position is not None
    assert np.linalg.norm(result.position.position_m - ROVER_M) < 0.1


def test_anchors_at_one_height_leave_the_rovers_to_the_ground() -> None:
    blind, standing = Detector(LEVEL, replace(SETTINGS, altitude_hint_m=0.0)), Detector(LEVEL, SETTINGS)
    errors_m: list[tuple[float, float]] = []
    for second in range(30):
        epoch = noisy(LEVEL, second)
        without = blind.process(epoch).position
        withit = standing.process(replace(epoch, ground=ground())).position
        assert without is not None
        assert withit is not None
        errors_m.append((abs(without.position_m[2] - ROVER_M[2]), abs(withit.position_m[2] - ROVER_M[2])))
    off_m = np.array(errors_m)[5:]
    assert off_m[:, 1].max() < 1.0
    assert off_m[:, 1].mean() < 0.2 * off_m[:, 0].mean()


def test_the_same_ground_told_over_and_over_makes_no_height_surer_than_it_is() -> None:
    detector = Detector(LEVEL, SETTINGS)
    for second in range(60):
        detector.process(replace(noisy(LEVEL, second), ground=ground(sigma_m=0.3)))
    fix = detector.foretold(60.0)
    assert fix is not None
    assert math.sqrt(fix.covariance_m2[2, 2]) > 0.9 * 0.3


def test_it_tells_where_the_track_leads() -> None:
    detector = Detector(drones(), SETTINGS)
    assert detector.foretold(0.0) is None
    step_m = np.array([1.0, 0.5, 0.0])
    for second in range(20):
        detector.process(noisy(drones(), second, ROVER_M + second * step_m))
    fix, later = detector.foretold(20.0), detector.foretold(25.0)
    assert fix is not None
    assert later is not None
    assert np.linalg.norm(fix.position_m - (ROVER_M + 20 * step_m)) < 1.0
    assert np.trace(later.covariance_m2) > np.trace(fix.covariance_m2)


@pytest.mark.parametrize(
    ("told", "dimension"),
    [(replace(ground(), sigma_m=0.0), 3), (replace(ground(), altitude_m=math.nan), 3), (ground(), 2)],
)
def test_ground_that_is_none_is_counted_and_not_used(told: GroundHeight, dimension: int) -> None:
    settings = replace(SETTINGS, dimension=2 if dimension == 2 else 3)
    result = detect_epoch(drones(), replace(heard(0.0, named(drones(), ROVER_M)), ground=told), settings)
    assert [(one.anchor_id, one.reason) for one in result.rejected] == [("", Rejection.BAD_GROUND)]
    assert len(DRONES_M) == len(result.verdicts)


@pytest.mark.parametrize("told", [None, ground()])
def test_where_an_epoch_meets_is_the_place_of_its_answer(told: GroundHeight | None) -> None:
    draw, found = np.random.default_rng(7), 0
    for second in range(60):
        anchors = drones(int(draw.integers(3, 9)))
        hidden = {one.id: float(draw.uniform(1.0, 30.0)) for one in anchors if draw.random() < 0.3}
        epoch = replace(heard(float(second), named(anchors, ROVER_M, hidden), D1=0.4), ground=told)
        answered, met = detect_epoch(anchors, epoch, SETTINGS).position, meeting_place(anchors, epoch, SETTINGS)
        assert (answered is None) == (met is None)
        if answered is not None and met is not None:
            found += 1
            assert met.position_m.tolist() == answered.position_m.tolist()
            assert met.covariance_m2.tolist() == answered.covariance_m2.tolist()
            assert (met.mirror_m is None) == (answered.mirror_m is None)
    assert found > 30
