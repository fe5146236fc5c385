"""A heading that drifts or is turned is found by the ranges, set right or dropped, and told."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from detection import Detector, DetectorSettings, EpochResult, OdometryCondition, RangeEpoch
from detection.simulation import RangingNoise, SimulatedDrive, draw_epochs, drive_along, occluded_by, random_occlusions
from tests.detection.worlds import drones

SETTINGS = DetectorSettings(max_speed_m_per_s=3.0)


def drive(offset_deg: float, drift_deg_per_min: float, minutes: int = 6) -> tuple[SimulatedDrive, list[RangeEpoch]]:
    """Legs at random among six drones, one of them hidden every other 15 s."""
    rng = np.random.default_rng(1)
    corners_m = [[*(np.array([150.0, 160.0]) + rng.uniform(-80.0, 80.0, 2)), 2.0] for _ in range(60)]
    whole = drive_along(drones(6), corners_m, 1.5)
    kept = slice(0, 60 * minutes)
    part = replace(whole, times_s=whole.times_s[kept], places_m=whole.places_m[kept], excess_m=whole.excess_m[kept])
    hidden = occluded_by(part, random_occlusions(part, 1, 15.0, 15.0, (1.0, 8.0), rng))
    noise = RangingNoise(
        heading_sigma_rad=0.02,
        heading_offset_rad=math.radians(offset_deg),
        heading_drift_rad_per_s=math.radians(drift_deg_per_min) / 60.0,
    )
    return hidden, list(draw_epochs(hidden, noise, rng))


def judged(way: SimulatedDrive, epochs: Sequence[RangeEpoch]) -> tuple[float, list[EpochResult], tuple[str, ...]]:
    """(root mean square of how far off, answers, warnings in the end)."""
    detector = Detector(way.anchors, SETTINGS)
    answers = [detector.process(epoch) for epoch in epochs]
    off_m = [
        math.dist(answer.position.position_m, place_m)
        for answer, place_m in zip(answers, way.places_m, strict=True)
        if answer.position is not None
    ]
    assert len(off_m) == len(epochs)
    return float(np.sqrt(np.mean(np.square(off_m)))), answers, detector.state.health.warnings


def without_heading(epochs: Sequence[RangeEpoch]) -> list[RangeEpoch]:
    return [
        replace(epoch, odometry=None if epoch.odometry is None else replace(epoch.odometry, heading_rad=None))
        for epoch in epochs
    ]


@pytest.mark.parametrize(
    ("offset_deg", "drift_deg_per_min"), [(0.0, 20.0), (0.0, -20.0), (90.0, 0.0), (180.0, 0.0), (-60.0, -10.0)]
)
def test_a_heading_that_is_off_does_no_harm_and_is_told(offset_deg: float, drift_deg_per_min: float) -> None:
    way, epochs = drive(offset_deg, drift_deg_per_min)
    off_m, _, warnings = judged(way, epochs)
    alone_m, _, quiet = judged(way, without_heading(epochs))
    assert off_m < 1.05 * alone_m
    assert [warning for warning in warnings if "heading" in warning]
    assert not [warning for warning in quiet if "heading" in warning]


def test_a_heading_that_is_right_is_used_and_nothing_is_told() -> None:
    way, epochs = drive(0.0, 0.0)
    off_m, answers, warnings = judged(way, epochs)
    assert off_m < judged(way, without_heading(epochs))[0]
    assert not [warning for warning in warnings if "heading" in warning]
    assert OdometryCondition.MISLED not in {answer.odometry for answer in answers}


def test_a_heading_that_points_backwards_is_dropped_for_a_while_and_the_epochs_say_so() -> None:
    way, epochs = drive(180.0, 0.0)
    _, answers, _ = judged(way, epochs)
    dropped = [answer.odometry is OdometryCondition.MISLED for answer in answers]
    assert 0 < sum(dropped) < 60
    assert not any(dropped[-60:])
