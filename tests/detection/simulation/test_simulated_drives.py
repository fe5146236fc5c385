"""Simulated drives: the truth, the patterns of occlusion, and what noisy sensors make of them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from detection import DetectionInputError
from detection.simulation import (
    Occlusion,
    RangingNoise,
    SimulatedDrive,
    draw_epochs,
    drive_along,
    occluded_by,
    random_occlusions,
)
from tests.detection.simulation.places import ANCHORS, WAY_M


def drive(every_s: float = 1.0) -> SimulatedDrive:
    return drive_along(ANCHORS, WAY_M, speed_m_per_s=2.0, every_s=every_s)


def test_a_drive_keeps_its_speed_and_goes_through_its_waypoints() -> None:
    driven = drive(0.5)
    assert driven.times_s[-1] == 60.0
    assert np.linalg.norm(np.diff(driven.places_m, axis=0), axis=1) == pytest.approx(1.0)
    assert driven.places_m[[0, 100, 120]] == pytest.approx(np.array(WAY_M))
    assert driven.distances_m[0, 0] == pytest.approx(math.dist((0.0, 0.0, 120.0), WAY_M[0]))
    assert not driven.excess_m.any()


def test_occlusions_are_where_the_pattern_says_and_the_longer_way_counts() -> None:
    hidden = occluded_by(
        drive(), [Occlusion("D2", 10.0, 20.0, 3.0), Occlusion("D2", 15.0, 18.0, 5.0), Occlusion("D4", 40.0, 1e9, 1.0)]
    )
    expected = np.zeros((61, 5))
    expected[10:20, 1] = 3.0
    expected[15:18, 1] = 5.0
    expected[40:, 3] = 1.0
    assert hidden.excess_m.tolist() == expected.tolist()


def test_what_is_not_heard_stays_unheard_when_occluded() -> None:
    silent = drive()
    silent = replace(silent, excess_m=np.where(np.arange(5) == 1, np.nan, silent.excess_m))
    hidden = occluded_by(silent, [Occlusion("D2", 10.0, 20.0, 3.0)])
    assert np.isnan(hidden.excess_m[:, 1]).all()
    assert all("D2" not in {r.anchor_id for r in epoch.ranges} for epoch in draw_epochs(
        hidden, RangingNoise(), np.random.default_rng(0)
    ))  # fmt: skip


def test_random_occlusions_hide_so_many_at_once_with_clear_times_between() -> None:
    drawn = random_occlusions(drive(), 2, 5.0, 4.0, (1.0, 2.0), np.random.default_rng(3))
    hidden = occluded_by(drive(), drawn)
    at_once = (hidden.excess_m > 0.0).sum(axis=1)
    assert set(at_once.tolist()) == {0, 2}
    assert not at_once[:3].any()
    assert len(drawn) == 2 * 6
    lengths = np.diff(np.flatnonzero(np.diff(at_once)))
    assert lengths.min() >= 3
    assert lengths.max() <= 6
    metres = hidden.excess_m[hidden.excess_m > 0.0]
    assert metres.min() >= 1.0
    assert metres.max() <= 2.0


def test_ranges_have_the_noise_and_the_excess_they_are_told() -> None:
    long_drive = drive_along(ANCHORS, WAY_M, speed_m_per_s=2.0, every_s=0.02)
    hidden = occluded_by(long_drive, [Occlusion("D3", 20.0, 1e9, 4.0)])
    epochs = draw_epochs(hidden, RangingNoise(0.2, occluded_sigma_m=0.5), np.random.default_rng(1))
    errors_m = np.array([[r.range_m for r in epoch.ranges] for epoch in epochs]) - hidden.distances_m
    # one sigma of a mean of 15,000 values of sigma 0.2 is 0.002
    assert errors_m[:, :2].mean() == pytest.approx(0.0, abs=0.008)
    assert errors_m[:, :2].std() == pytest.approx(0.2, rel=0.05)
    assert errors_m[1000:, 2].mean() == pytest.approx(4.0, abs=0.05)
    assert errors_m[1000:, 2].std() == pytest.approx(0.5, rel=0.1)


def test_odometry_is_what_was_driven_and_the_first_epoch_has_none() -> None:
    exact = RangingNoise(wheel_sigma_m=0.0, heading_sigma_rad=0.0)
    epochs = draw_epochs(drive(), exact, np.random.default_rng(0))
    assert epochs[0].odometry is None
    for epoch in epochs[1:]:
        assert epoch.odometry is not None
        assert epoch.odometry.duration_s == pytest.approx(1.0)
        assert epoch.odometry.wheel_m == pytest.approx((2.0, 0.0))
    assert epochs[10].odometry is not None
    assert epochs[10].odometry.heading_rad == pytest.approx(math.atan2(60.0, 80.0))
    without = draw_epochs(drive(), RangingNoise(wheel_sigma_m=None), np.random.default_rng(0))
    assert all(epoch.odometry is None for epoch in without)
    unknown_heading = draw_epochs(drive(), RangingNoise(), np.random.default_rng(0))[1].odometry
    assert unknown_heading is not None
    assert unknown_heading.heading_rad is None


def test_predictions_and_losses_are_as_told_and_the_same_generator_draws_the_same() -> None:
    foretold = replace(drive(), p_sight=np.tile([0.9, 0.1, np.nan, 0.5, 1.0], (61, 1)))
    noise = RangingNoise(lost_share=0.25)
    epochs = draw_epochs(foretold, noise, np.random.default_rng(7))
    assert epochs == draw_epochs(foretold, noise, np.random.default_rng(7))
    told = {r.anchor_id: r.p_sight for epoch in epochs for r in epoch.ranges}
    assert told == {"D1": 0.9, "D2": 0.1, "D3": None, "D4": 0.5, "D5": 1.0}
    heard = sum(len(epoch.ranges) for epoch in epochs)
    assert heard / (61 * 5) == pytest.approx(0.75, abs=4 * math.sqrt(0.25 * 0.75 / 305))


BAD: dict[str, Any] = {
    "excess_m must be \\(61, 5\\)": lambda: replace(drive(), excess_m=np.zeros((61, 4))),
    "p_sight must be": lambda: replace(drive(), p_sight=np.zeros((60, 5))),
    "places_m must be \\(61, 2\\)": lambda: replace(drive(), places_m=np.zeros((61, 4))),
    "places_m must be finite": lambda: replace(drive(), places_m=np.full((61, 3), np.nan)),
    "times_s must be finite and rise": lambda: replace(drive(), times_s=np.zeros(61)),
    "excess_m must be 0, positive": lambda: replace(drive(), excess_m=np.full((61, 5), -0.1)),
    "ids must be unique": lambda: replace(drive(), anchors=(ANCHORS[0],) * 5),
    "at least two waypoints": lambda: drive_along(ANCHORS, WAY_M[:1], 1.0),
    "must be > 0": lambda: drive_along(ANCHORS, WAY_M, 0.0),
    "no anchor 'Z'": lambda: occluded_by(drive(), [Occlusion("Z", 0.0, 1.0, 1.0)]),
    "excess_m must be > 0": lambda: occluded_by(drive(), [Occlusion("D1", 0.0, 1.0, -1.0)]),
    "range_sigma_m must be": lambda: RangingNoise(-0.1),
    "wheel_sigma_m must be": lambda: RangingNoise(wheel_sigma_m=math.nan),
    "lost_share must be": lambda: RangingNoise(lost_share=1.0),
}  # fmt: skip


@pytest.mark.parametrize("sentence", BAD)
def test_a_drive_that_cannot_be_is_refused(sentence: str) -> None:
    with pytest.raises(DetectionInputError, match=sentence):
        BAD[sentence]()
