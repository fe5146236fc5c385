"""The measures of a simulated drive: exact on drives that are told by hand, their intervals against the textbook."""

from __future__ import annotations

import math

import numpy as np
import pytest

from detection import DetectionInputError, DetectorSettings, RangingAnchor
from detection.simulation import (
    DriveOutcome,
    Occlusion,
    RangingNoise,
    SimulatedDrive,
    draw_epochs,
    drive_along,
    judge_by_epoch,
    judge_drive,
    locate_without_detector,
    metrics_of,
    occluded_by,
)
from tests.detection.simulation.places import ANCHORS, WAY_M


def generator() -> np.random.Generator:
    return np.random.default_rng(11)


def outcome(
    excess_m: list[list[float]], sight: list[list[int]], error_m: list[float], every_s: float = 1.0
) -> DriveOutcome:
    anchors = tuple(RangingAnchor(f"D{k}", 10.0 * k, 0.0) for k in range(len(excess_m[0])))
    count = len(excess_m)
    drive = SimulatedDrive(
        anchors, every_s * np.arange(count, dtype=np.float64), np.zeros((count, 2)), np.array(excess_m)
    )
    position_m = np.column_stack([error_m, np.zeros(count)])
    return DriveOutcome(drive, np.array(sight, np.uint8), position_m, np.where(np.isnan(error_m), np.nan, 0.1))


TOLD = outcome(
    [[0, 0], [3, 0], [3, 0], [3, 0.2], [0, 0.2], [5, 0], [0, 0]],
    [[0, 0], [0, 0], [1, 1], [1, 1], [2, 0], [0, 0], [0, 255]],
    [0.1, 3.0, 0.1, math.nan, 0.1, 0.1, 0.1],
    every_s=0.5,
)


def test_every_measure_is_what_counting_by_hand_gives() -> None:
    measured = metrics_of([TOLD], harmful_m=0.5, valid_m=1.0, generator=generator())
    assert (measured.true_positives.value, measured.true_positives.count) == (2 / 4, 4)
    # in sight: 3 of the first anchor, 4 of the second; slight excess is neither
    assert (measured.false_positives.value, measured.false_positives.count) == (1 / 7, 7)
    assert measured.unknown.value == 1 / 13
    assert (measured.noticed.value, measured.noticed.count) == (1 / 2, 2)
    assert (measured.response_s.value, measured.response_s.count) == (0.5, 1)
    assert measured.availability.value == 6 / 7
    assert measured.valid.value == 5 / 7
    assert measured.position_rms_m.value == pytest.approx(math.sqrt((9.0 + 5 * 0.01) / 6))


def test_an_occlusion_from_the_first_epoch_on_has_no_onset() -> None:
    always = outcome([[3.0]] * 4, [[1]] * 4, [0.0] * 4)
    measured = metrics_of([always], 0.5, 1.0, generator())
    assert measured.true_positives.value == 1.0
    assert measured.noticed.count == 0
    assert math.isnan(measured.response_s.value)
    assert math.isnan(measured.false_positives.value)


def test_an_anchor_that_is_silent_in_between_is_waited_for_from_its_first_harmful_range() -> None:
    gaps = outcome([[0.0], [3.0], [3.0], [3.0]], [[0], [255], [0], [1]], [0.0] * 4)
    assert metrics_of([gaps], 0.5, 1.0, generator()).response_s.value == 1.0


def test_a_rate_of_one_drive_has_the_interval_of_wilson() -> None:
    rate = metrics_of([TOLD], 0.5, 1.0, generator()).false_positives
    share, count, z = 1 / 7, 7, 1.959963984540054
    centre = (share + z**2 / (2 * count)) / (1 + z**2 / count)
    half = z / (1 + z**2 / count) * math.sqrt(share * (1 - share) / count + z**2 / (4 * count**2))
    assert (rate.low, rate.high) == pytest.approx((centre - half, centre + half))


def test_drives_that_differ_widen_the_interval_beyond_that_of_independent_ranges() -> None:
    good = outcome([[3.0]] * 50, [[1]] * 50, [0.1] * 50)
    bad = outcome([[3.0]] * 50, [[0]] * 50, [0.3] * 50)
    measured = metrics_of([good, bad] * 4, 0.5, 1.0, generator())
    rate = measured.true_positives
    assert rate.value == 0.5
    # eight drives, each all or nothing: one sigma of the mean is 0.18; 400 independent ranges would have 0.025
    assert rate.low < 0.3
    assert rate.high > 0.7
    assert measured.position_rms_m.low < measured.position_rms_m.value < measured.position_rms_m.high


def test_what_never_happened_may_still_happen() -> None:
    perfect = outcome([[0.0]] * 50, [[0]] * 50, [0.1] * 50)
    rate = metrics_of([perfect] * 5, 0.5, 1.0, generator()).false_positives
    assert rate.value == rate.low == 0.0
    assert 0.0 < rate.high < 0.02


def test_the_interval_of_the_response_time_holds_its_median() -> None:
    waits = [1, 1, 2, 2, 3, 3, 4, 5, 5]
    drives = [outcome([[0.0]] + [[3.0]] * 6, [[0]] * (1 + wait) + [[1]] * (6 - wait), [0.0] * 7) for wait in waits]
    response = metrics_of(drives, 0.5, 1.0, generator()).response_s
    assert response.value == 3.0
    assert 1.0 <= response.low < 3.0 < response.high <= 5.0


def test_measures_of_nothing_are_refused() -> None:
    with pytest.raises(DetectionInputError, match="at least one drive"):
        metrics_of([], 0.5, 1.0, generator())
    with pytest.raises(DetectionInputError, match="valid_m > 0"):
        metrics_of([TOLD], 0.5, 0.0, generator())


def test_a_clean_drive_with_one_large_occlusion_is_judged_without_a_mistake() -> None:
    drive = occluded_by(drive_along(ANCHORS, WAY_M, 2.0), [Occlusion("D3", 20.5, 40.5, 6.0)])
    epochs = draw_epochs(drive, RangingNoise(0.05), np.random.default_rng(5))
    settings = DetectorSettings(range_sigma_m=0.05, k_geometric=5.0)
    for judge in (judge_drive, judge_by_epoch):
        judged = judge(drive, epochs, settings)
        assert judged.sight.tolist() == (drive.excess_m > 0.0).astype(int).tolist()
        assert np.median(judged.position_error_m) < 0.5
    plain_m = np.linalg.norm(locate_without_detector(drive, epochs) - drive.places_m, axis=1)
    assert plain_m[:20].max() < 0.5
    assert plain_m[21:40].min() > 1.0


def test_too_few_ranges_give_no_place_without_a_detector() -> None:
    drive = drive_along(ANCHORS[:2], WAY_M, 2.0)
    epochs = draw_epochs(drive, RangingNoise(), generator())
    assert np.isnan(locate_without_detector(drive, epochs)).all()
