"""Weights, thresholds, agreement, health, and what the settings make more or less sensitive."""

from __future__ import annotations

import math
from typing import Literal

import pytest

from detection import DetectorSettings, Say, Sight, Witness, WitnessSay
from detection.epoch_results import verdict_on
from detection.epochs import RangeMeasurement
from detection.fusion import (
    GEOMETRY_WEIGHTS,
    MOTION_WEIGHT,
    ODOMETRY_WEIGHTS,
    fuse,
    fused_probability,
    is_good_geometry,
)
from detection.state import Monitor, sensitivity_scale

SETTINGS = DetectorSettings()


def say(witness: Witness, occluded: bool | None, weight: float, probability: float | None = None) -> WitnessSay:
    if occluded is None:
        return WitnessSay(witness, Say.SILENT, math.nan, weight, "nothing")
    p = float(occluded) if probability is None else probability
    return WitnessSay(witness, Say.OCCLUDED if occluded else Say.CLEAR, 1.0, weight, "so it is", p)


def both(geometry: bool | None, odometry: bool | None, good: bool = True, reliable: bool = True) -> list[WitnessSay]:
    return [
        say(Witness.GEOMETRY, geometry, GEOMETRY_WEIGHTS[0 if good else 1]),
        say(Witness.ODOMETRY, odometry, ODOMETRY_WEIGHTS[0 if reliable else 1]),
    ]


def test_weights_are_those_of_the_specification_and_sum_to_one() -> None:
    assert GEOMETRY_WEIGHTS == (0.7, 0.3)
    assert ODOMETRY_WEIGHTS == (0.8, 0.2)
    assert fused_probability(both(True, False)) == pytest.approx(7 / 15)
    assert fused_probability(both(False, True)) == pytest.approx(8 / 15)
    assert fused_probability(both(True, True)) == pytest.approx(1.0)
    assert is_good_geometry(1.5)
    assert not is_good_geometry(9.0)


@pytest.mark.parametrize(
    ("says", "probability", "sight", "agree"),
    [
        (both(True, True), 1.0, Sight.OCCLUDED, True),
        (both(False, False), 0.0, Sight.CLEAR, True),
        (both(True, False), 7 / 15, Sight.OCCLUDED, False),  # above 0.4, below 0.6: cautious where they differ
        (both(False, True), 8 / 15, Sight.OCCLUDED, False),
        (both(True, False, good=False), 3 / 11, Sight.CLEAR, False),
        (both(False, True, reliable=False), 2 / 9, Sight.CLEAR, False),
        (both(True, None), 1.0, Sight.OCCLUDED, True),
        (both(None, None), None, Sight.UNKNOWN, True),
    ],
)
def test_the_decision_is_that_of_the_table(
    says: list[WitnessSay], probability: float | None, sight: Sight, agree: bool
) -> None:
    told, fused, agreed = fuse(says, SETTINGS)
    assert fused == (None if probability is None else pytest.approx(probability))
    assert (told, agreed) == (sight, agree)


def test_the_threshold_is_higher_where_all_agree() -> None:
    doubtful = [say(Witness.MOTION, True, MOTION_WEIGHT, 0.55)]
    assert fuse(doubtful, SETTINGS)[0] is Sight.CLEAR
    assert fuse(doubtful, DetectorSettings(occlusion_threshold=0.5))[0] is Sight.OCCLUDED
    assert fuse([*doubtful, *both(False, None)], SETTINGS)[0] is Sight.OCCLUDED  # 0.407, where they differ


def test_the_track_outvotes_one_witness_but_not_both() -> None:
    track = say(Witness.MOTION, False, MOTION_WEIGHT)
    assert fuse([*both(True, False), track], SETTINGS)[0] is Sight.CLEAR
    assert fuse([*both(True, True), track], SETTINGS)[0] is Sight.OCCLUDED


def test_silent_witnesses_do_not_count() -> None:
    assert fused_probability([say(Witness.GEOMETRY, True, 0.1), say(Witness.ODOMETRY, None, 5.0)]) == 1.0


def test_a_verdict_says_which_witness_said_what_and_whether_they_differ() -> None:
    says = [
        WitnessSay(Witness.GEOMETRY, Say.OCCLUDED, 3.0, 0.7, "it misses by +3.00 m", 1.0),
        WitnessSay(Witness.ODOMETRY, Say.CLEAR, 0.1, 0.8, "it changed no more than the rover moved", 0.0),
        WitnessSay(Witness.MOTION, Say.SILENT, math.nan, 0.0, "the track is not settled yet"),
        WitnessSay(Witness.PREDICTION, Say.OCCLUDED, math.nan, 0.0, "a probability of sight of 10% was predicted", 0.9),
    ]
    verdict = verdict_on(RangeMeasurement("D4", 80.0), 3.0, 0.3, says, SETTINGS)
    assert verdict.occluded
    assert verdict.score == pytest.approx(10.0)
    assert verdict.reason == (
        "D4 is occluded, though the witnesses differ. Geometry: it misses by +3.00 m; odometry: it changed no more "
        "than the rover moved; the prediction: a probability of sight of 10% was predicted."
    )


@pytest.mark.parametrize(("p_sight", "probability"), [(None, 0.5), (0.9, 0.1)])
def test_where_nobody_speaks_sight_is_unknown_with_the_predicted_probability(
    p_sight: float | None, probability: float
) -> None:
    measured = RangeMeasurement("D4", 80.0, p_sight=p_sight)
    verdict = verdict_on(measured, math.nan, 0.3, both(None, None), SETTINGS)
    assert verdict.sight is Sight.UNKNOWN
    assert not verdict.occluded
    assert (verdict.probability, verdict.confidence) == (pytest.approx(probability), 0.0)


def test_a_witness_that_is_overruled_loses_weight_and_is_warned_of() -> None:
    monitor = Monitor()
    for k in range(100):
        monitor.note("geometry", k % 4 == 0)
        monitor.note("odometry", False)
    assert monitor.accuracy("geometry") == pytest.approx(0.75, abs=0.01)
    assert monitor.accuracy("odometry") == 1.0
    health = monitor.health()
    assert health.geometry_false_positives == pytest.approx(0.25, abs=0.01)
    assert health.warnings == ("The geometry witness is often overruled: 25% of its ranges.",)


def test_what_was_long_ago_counts_no_more() -> None:
    monitor = Monitor()
    for k in range(3000):
        monitor.note("geometry", k < 200)
    assert monitor.health().geometry_false_positives < 0.01


def test_odometry_that_keeps_failing_is_flagged_as_systematic_but_not_at_its_first_failures() -> None:
    monitor = Monitor()
    for _ in range(19):
        monitor.note_odometry(False)
    assert not monitor.odometry_fails
    monitor.note_odometry(False)
    assert monitor.odometry_fails
    assert monitor.health().warnings == ("Odometry fails systematically: 100% of its increments are unreliable.",)
    for _ in range(400):
        monitor.note_odometry(True)
    assert not monitor.odometry_fails


@pytest.mark.parametrize("terrain", ["open", "mixed", "complex"])
@pytest.mark.parametrize("criticality", ["low", "normal", "high"])
def test_complex_ground_and_critical_missions_are_more_sensitive(
    terrain: Literal["open", "mixed", "complex"], criticality: Literal["low", "normal", "high"]
) -> None:
    scale = sensitivity_scale(DetectorSettings(terrain=terrain, criticality=criticality))
    by_rank = {"open": 1, "mixed": 0, "complex": -1, "low": 1, "normal": 0, "high": -1}
    rank = by_rank[terrain] + by_rank[criticality]
    assert (scale > 1.0) is (rank > 0)
    assert scale == pytest.approx(1.0) or (scale < 1.0) is (rank < 0)
