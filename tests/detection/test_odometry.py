"""Odometry: displacement and its cross-check, the triangle test, the law of cosines, the window, clocks that differ."""

from __future__ import annotations

import math

import numpy as np
import pytest

from detection import (
    Detector,
    DetectorSettings,
    EpochResult,
    OdometryCondition,
    OdometryIncrement,
    RangeEpoch,
    RangeMeasurement,
    RangingAnchor,
    Say,
)
from detection.motion.odometry import Motion, aligned, motion_of

SETTINGS = DetectorSettings(wheel_sigma_m=0.02, accelerometer_sigma_m=0.02, max_speed_m_per_s=3.0, range_sigma_m=0.05)
RELIABLE, STUCK, SLIPPED = OdometryCondition.RELIABLE, OdometryCondition.STUCK, OdometryCondition.SLIPPED


@pytest.mark.parametrize(
    ("wheel_m", "accelerometer_m", "condition", "length_m"),
    [
        ((3.0, 4.0), None, OdometryCondition.TOO_FAST, 5.0),
        ((0.6, 0.8), None, RELIABLE, 1.0),
        (None, (0.0, 0.3, 0.4), RELIABLE, 0.5),
        ((1.0, 0.0), (1.0, 0.0, 0.0), RELIABLE, 1.0),
        ((0.3, 0.0), (0.3, 0.0, 0.4), RELIABLE, 0.5),  # wheels know the level way, the accelerometer the climb
        ((1.0, 0.0), (0.0, 0.0, 0.0), STUCK, 1.0),
        ((0.0, 0.0), (0.5, 0.0, 0.0), SLIPPED, 0.0),
        ((1.0, 0.0), (0.5, 0.0, 0.0), OdometryCondition.DIFFERENT, 1.0),
        ((0.0, 0.0), (0.0, 0.0, 0.0), RELIABLE, 0.0),
        (None, None, OdometryCondition.MISSING, math.nan),
    ],
)
def test_displacement_is_cross_checked(
    wheel_m: tuple[float, float] | None,
    accelerometer_m: tuple[float, float, float] | None,
    condition: OdometryCondition,
    length_m: float,
) -> None:
    motion = motion_of(OdometryIncrement(1.0, wheel_m, accelerometer_m), SETTINGS)
    assert motion.condition is condition
    assert motion.length_m == pytest.approx(length_m, nan_ok=True)
    assert motion.reliable is (condition is RELIABLE)


def test_speed_is_judged_by_the_duration() -> None:
    way_m = (2.0, 0.0)
    assert motion_of(OdometryIncrement(0.5, way_m), SETTINGS).condition is OdometryCondition.TOO_FAST
    assert motion_of(OdometryIncrement(1.0, way_m), SETTINGS).condition is RELIABLE


# One anchor alone: geometry and track stay silent, so that odometry speaks by itself.
ANCHOR = RangingAnchor("A", 0.0, 0.0)


def replay(
    ranges_m: list[float], steps_m: list[float | None], settings: DetectorSettings = SETTINGS
) -> list[EpochResult]:
    detector = Detector([ANCHOR], settings)
    answers = []
    for second, (range_m, step_m) in enumerate(zip(ranges_m, steps_m, strict=True)):
        odometry = None if step_m is None else OdometryIncrement(1.0, (step_m, 0.0))
        answers.append(detector.process(RangeEpoch(float(second), (RangeMeasurement("A", range_m),), odometry)))
    return answers


def says(answers: list[EpochResult]) -> list[Say]:
    return [answer.verdicts[0].says[1].says for answer in answers]


def test_a_range_that_jumps_by_more_than_the_way_is_flagged_once_three_of_five_epochs_agree() -> None:
    answers = replay([50.0] * 3 + [53.0] * 5, [0.0] * 8)
    assert says(answers) == [Say.SILENT, Say.CLEAR, Say.CLEAR, Say.SILENT, Say.SILENT, *[Say.OCCLUDED] * 3]
    assert [answer.excluded for answer in answers[-3:]] == [("A",)] * 3
    assert "by far" in answers[-1].verdicts[0].reason  # more than twice the tolerance: high confidence
    assert "not confirmed yet" in answers[3].verdicts[0].says[1].reason


def test_a_lasting_occlusion_stays_flagged_though_its_range_changes_no_more() -> None:
    assert set(says(replay([50.0] * 5 + [53.0] * 20, [0.0] * 25))[8:]) == {Say.OCCLUDED}


def test_one_outlier_is_no_occlusion() -> None:
    assert Say.OCCLUDED not in says(replay([50.0] * 4 + [54.0] + [50.0] * 5, [0.0] * 10))


def test_a_small_excess_is_flagged_without_high_confidence() -> None:
    answers = replay([50.0] * 3 + [50.3] * 5, [0.0] * 8)
    assert says(answers)[-1] is Say.OCCLUDED
    assert "by far" not in answers[-1].verdicts[0].reason


def test_a_range_that_changes_as_the_rover_drives_is_clear() -> None:
    assert set(says(replay([50.0 + 2.0 * k for k in range(10)], [2.0] * 10))[1:]) == {Say.CLEAR}


def test_a_range_that_falls_by_more_than_the_way_was_too_long_before() -> None:
    answers = replay([53.0] + [50.0] * 6, [0.0] * 7)
    assert Say.OCCLUDED not in says(answers)
    assert "it was too long before" in answers[1].verdicts[0].says[1].reason


def test_without_odometry_nothing_is_compared_and_it_begins_anew_after() -> None:
    assert set(says(replay([50.0, 53.0, 53.0, 53.0, 53.0], [None] * 5))) == {Say.SILENT}
    answers = replay([50.0, 50.0, 70.0, 70.0, 70.0], [0.0, 0.0, None, 0.0, 0.0])
    assert says(answers)[2:] == [Say.SILENT, Say.CLEAR, Say.CLEAR]


def test_unreliable_odometry_suspends_the_test() -> None:
    answers = replay([50.0] * 2 + [60.0] * 6, [0.0, 0.0, *[99.0] * 6])
    assert {answer.odometry for answer in answers[2:]} == {OdometryCondition.TOO_FAST}
    assert Say.OCCLUDED not in says(answers)


@pytest.mark.parametrize(("window", "persistence", "delay"), [(1, 1.0, 0), (5, 0.6, 2), (5, 1.0, 4), (10, 0.6, 5)])
def test_window_and_persistence_say_how_long_confirmation_takes(window: int, persistence: float, delay: int) -> None:
    settings = DetectorSettings(range_sigma_m=0.05, window=window, persistence=persistence)
    answers = replay([50.0] * 12 + [55.0] * 12, [0.0] * 24, settings)
    assert says(answers).index(Say.OCCLUDED) == 12 + delay


def test_a_fixed_tolerance_replaces_k_sigma() -> None:
    wide = DetectorSettings(odometry_tolerance_m=4.0)
    assert Say.OCCLUDED not in says(replay([50.0] * 3 + [53.0] * 6, [0.0] * 9, wide))


def motion(length_m: float, duration_s: float = 1.0) -> Motion:
    return Motion(length_m, 0.02, duration_s, (length_m, 0.0), RELIABLE)


def test_odometry_of_a_slow_clock_borrows_from_the_increment_before() -> None:
    """An increment stamped by a clock half a second behind began half a second late."""
    shifted = aligned(motion(1.0), motion(3.0), -0.5)
    assert shifted.length_m == pytest.approx(2.0)
    assert shifted.displacement_m == pytest.approx((2.0, 0.0))
    assert aligned(motion(1.0), motion(3.0), 0.0).length_m == 3.0
    assert aligned(None, motion(3.0), -0.5).length_m == 3.0


def test_the_offset_of_the_odometry_clock_is_taken_out() -> None:
    """A rover that brakes: odometry that covers half a second too late tells of too short a way."""
    seconds = range(1, 8)
    ways_m = [0.0] + [10.5 - k for k in seconds]  # at 10 - t metres per second
    told_m: list[float | None] = [10.0, *(10.0 - k for k in seconds)]
    ranges_m = (50.0 + np.cumsum(ways_m)).tolist()
    unaware = replay(ranges_m, told_m, DetectorSettings(range_sigma_m=0.03, max_speed_m_per_s=20.0))
    aware = DetectorSettings(range_sigma_m=0.03, max_speed_m_per_s=20.0, odometry_offset_s=-0.5)
    assert Say.OCCLUDED in says(unaware)
    assert set(says(replay(ranges_m, told_m, aware))[1:]) == {Say.CLEAR}


def test_answers_carry_the_time_of_the_base_station() -> None:
    settings = DetectorSettings(ranging_offset_s=2.0, base_offset_s=5.0)
    assert replay([50.0], [None], settings)[0].time_s == 3.0
