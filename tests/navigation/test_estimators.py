"""A filter behind a detector: what verdicts weigh, how high the ground is, how fast wheels turn, where it is lost."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from detection import (
    Detector,
    DetectorSettings,
    GroundHeight,
    OdometryIncrement,
    RangeEpoch,
    RangeMeasurement,
    RangingAnchor,
)
from navigation import ConstantVelocityEstimator, RoverEstimate, StateError

PLACES_M = {
    "A1": (0.0, 0.0, 60.0),
    "A2": (300.0, 0.0, 40.0),
    "A3": (300.0, 300.0, 70.0),
    "A4": (0.0, 300.0, 50.0),
    "A5": (150.0, 150.0, 90.0),
    "A6": (80.0, 220.0, 30.0),
}
ANCHORS = [RangingAnchor(name, *place_m) for name, place_m in PLACES_M.items()]
SETTINGS = DetectorSettings(max_speed_m_per_s=4.0)
SPEED = 1.5


def place(second: float) -> tuple[float, float, float]:
    return 60.0 + SPEED * second, 100.0, 1.5


def epoch(
    second: float,
    too_long_m: dict[str, float] | None = None,
    only: tuple[str, ...] = tuple(PLACES_M),
    odometry: OdometryIncrement | None = None,
    ground: GroundHeight | None = None,
    noise: np.random.Generator | None = None,
) -> RangeEpoch:
    ranges = tuple(
        RangeMeasurement(
            name,
            math.dist(PLACES_M[name], place(second))
            + (too_long_m or {}).get(name, 0.0)
            + (0.1 * noise.standard_normal() if noise else 0.0),
        )
        for name in only
    )
    return RangeEpoch(second, ranges, odometry, ground=ground)


def driven(*epochs: RangeEpoch) -> list[RoverEstimate | None]:
    detector, estimator = Detector(ANCHORS, SETTINGS), ConstantVelocityEstimator(ANCHORS, SETTINGS)
    answers = []
    for one in epochs:
        result = detector.process(one)
        answers.append(estimator.step(one, result, detector.motion))
    return answers


def there(estimate: RoverEstimate | None) -> RoverEstimate:
    assert estimate is not None
    return estimate


def test_exact_ranges_lead_to_the_place_and_to_the_velocity() -> None:
    last = there(driven(*[epoch(second) for second in range(20)])[-1])
    np.testing.assert_allclose(last.position_m, place(19), atol=0.02)
    np.testing.assert_allclose(last.velocity_m_per_s, (SPEED, 0.0, 0.0), atol=0.05)
    assert last.used == tuple(PLACES_M)


def test_a_range_that_is_called_occluded_weighs_nothing() -> None:
    answers = driven(*[epoch(second, {"A4": 8.0}) for second in range(20)])
    last = there(answers[-1])
    assert "A4" not in last.used
    np.testing.assert_allclose(last.position_m, place(19), atol=0.05)


def test_errors_of_noisy_ranges_stay_in_the_bubble_and_are_not_far_smaller_than_told() -> None:
    noise = np.random.default_rng(3)
    answers = driven(*[epoch(second, noise=noise) for second in np.arange(0.0, 80.0, 0.5)])[20:]
    off_m = [there(one).position_m - place(one.time_s if one else 0.0) for one in answers]
    assert all(np.linalg.norm(off) < there(one).bubble_m for off, one in zip(off_m, answers, strict=True))
    squares = [o @ np.linalg.solve(there(one).covariance[:3, :3], o) for o, one in zip(off_m, answers, strict=True)]
    assert 0.2 < np.mean(squares) < 3.0, "of three axes 3 is exact, less is careful"


def test_the_ground_holds_the_height_where_two_ranges_are_left_and_never_surer_than_it_is() -> None:
    ground = GroundHeight(0.0, 0.0, 1.5, 0.0, 0.0, 0.5)
    open_sky = [epoch(second, ground=ground) for second in range(10)]
    shadow = [epoch(second, only=("A2", "A5"), ground=ground) for second in range(10, 40)]
    without = [replace(one, ground=None) for one in shadow]
    held, loose = there(driven(*open_sky, *shadow)[-1]), there(driven(*open_sky, *without)[-1])
    assert 0.45 < math.sqrt(held.covariance[2, 2]) < 0.51
    assert math.sqrt(loose.covariance[2, 2]) > 2.0
    assert abs(held.position_m[2] - 1.5) < 0.5


def test_wheels_hold_the_way_where_no_range_is_left() -> None:
    wheels = OdometryIncrement(1.0, (SPEED, 0.0), heading_rad=math.pi / 2.0)
    before = [epoch(second, odometry=wheels) for second in range(10)]
    shadow = [epoch(second, only=(), odometry=wheels) for second in range(10, 25)]
    without = [replace(one, odometry=None) for one in shadow]
    held, loose = there(driven(*before, *shadow)[-1]), there(driven(*before, *without)[-1])
    np.testing.assert_allclose(held.position_m, place(24), atol=0.5)
    assert held.bubble_m < 0.5 * loose.bubble_m


def test_a_length_without_a_heading_holds_the_speed() -> None:
    turning = OdometryIncrement(1.0, (SPEED, 0.0))
    before = [epoch(second, odometry=turning) for second in range(10)]
    shadow = [epoch(second, only=(), odometry=turning) for second in range(10, 16)]
    last = there(driven(*before, *shadow)[-1])
    assert np.linalg.norm(last.velocity_m_per_s[:2]) == pytest.approx(SPEED, abs=0.1)


def test_a_filter_that_was_led_astray_begins_anew_where_ranges_meet() -> None:
    detector, estimator = Detector(ANCHORS, SETTINGS), ConstantVelocityEstimator(ANCHORS, SETTINGS)
    for second in range(5):
        one = epoch(second)
        estimator.step(one, detector.process(one), None)
    jump = 100.0  # carried on in one second by as far as it drives in so many
    answers = []
    for second in range(6, 26):
        one = replace(epoch(second + jump), time_s=float(second))
        answers.append(estimator.step(one, detector.process(one), None))
    assert any(there(one).reacquired for one in answers)
    np.testing.assert_allclose(there(answers[-1]).position_m, place(25 + jump), atol=1.0)


def test_it_begins_anew_after_a_long_silence_and_after_a_clock_was_set_back() -> None:
    late = [replace(epoch(second), time_s=second + 1000.0) for second in range(10)]
    answers = driven(*[epoch(second) for second in range(10)], *late)
    np.testing.assert_allclose(there(answers[-1]).position_m, place(9), atol=0.05)
    again = driven(*late, *[epoch(second) for second in range(30)])
    np.testing.assert_allclose(there(again[-1]).position_m, place(29), atol=0.05)


def test_before_a_position_is_confirmed_there_is_no_estimate() -> None:
    assert driven(epoch(0, only=("A1", "A2", "A3"))) == [None]


def test_in_the_plane_there_is_none() -> None:
    with pytest.raises(StateError, match="three dimensions"):
        ConstantVelocityEstimator(ANCHORS, replace(SETTINGS, dimension=2))
