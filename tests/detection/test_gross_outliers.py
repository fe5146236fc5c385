"""Ranges that are off by anything move the excess, not the rover: a session is never worse than its own epochs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.detection.outliers import KINDS, follow_drives
from detection import Detector, DetectorSettings, PlanningStatus
from tests.detection.worlds import drones, heard, named

SETTINGS = DetectorSettings(range_sigma_m=0.05)
START_M, EACH_SECOND_M = np.array([60.0, 80.0, 2.0]), np.array([2.5, 2.0, 0.0])


def places(seconds: int) -> list[np.ndarray]:
    return [START_M + second * EACH_SECOND_M for second in range(seconds)]


def off_m(wrong: dict[int, dict[str, float]], seconds: int = 60) -> list[float]:
    """How far off a session is, second by second; wrong: by second, what some ranges say instead."""
    anchors, rng = drones(6), np.random.default_rng(1)
    detector = Detector(anchors, SETTINGS)
    found = []
    for second, place_m in enumerate(places(seconds)):
        ranges_m = {name: r + 0.05 * rng.normal() for name, r in named(anchors, place_m).items()}
        answer = detector.process(heard(float(second), {**ranges_m, **wrong.get(second, {})}))
        assert answer.position is not None
        found.append(math.dist(answer.position.position_m, place_m))
        assert set(wrong.get(second, {})) <= set(answer.excluded)
    return found


def test_one_jump_at_the_second_epoch_does_not_carry_the_rover_away() -> None:
    assert max(off_m({1: {"D1": 33.7}})) < 0.6


@pytest.mark.parametrize("sentinel_m", [655.35, 65535.0])
def test_a_counter_that_runs_over_in_one_anchor_of_each_epoch_is_set_aside(sentinel_m: float) -> None:
    found = off_m({second: {f"D{second % 6 + 1}": sentinel_m} for second in range(60)})
    assert float(np.sqrt(np.mean(np.square(found)))) < 0.3


def test_two_anchors_under_each_others_name_stay_outside_for_ever() -> None:
    anchors = drones(6)
    swapped = {}
    for second, place_m in enumerate(places(60)):
        ranges_m = named(anchors, place_m)
        swapped[second] = {"D2": ranges_m["D5"], "D5": ranges_m["D2"]}
    assert max(off_m(swapped)) < 1.0


def test_an_anchor_that_is_always_tens_of_metres_too_short_stays_outside() -> None:
    anchors = drones(6)
    short = {second: {"D3": named(anchors, place_m)["D3"] - 35.0} for second, place_m in enumerate(places(60))}
    assert max(off_m(short)) < 0.6


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("every_s", [1.0, 0.1])
def test_a_session_stays_near_its_own_epochs_and_is_not_sure_of_what_is_wrong(kind: str, every_s: float) -> None:
    """A short form of the table in docs/detection-proof.md."""
    found = follow_drives(KINDS[kind], every_s, 2, np.random.default_rng(8))
    assert found.near >= 0.99
    assert found.misled == 0
    rms_m = float(np.sqrt(np.nanmean(found.from_truth_m**2)))
    assert rms_m <= 1.1 * float(np.sqrt(np.nanmean(found.alone_from_truth_m**2)))


def test_what_is_left_out_leaves_the_position_degraded_not_unchecked() -> None:
    anchors = drones(6)
    detector = Detector(anchors, SETTINGS)
    for second, place_m in enumerate(places(5)):
        answer = detector.process(heard(float(second), {**named(anchors, place_m), "D4": 65535.0}))
    assert answer.planning is PlanningStatus.DEGRADED
    assert answer.excluded == ("D4",)
