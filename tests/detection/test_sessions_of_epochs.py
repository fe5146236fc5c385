"""A session over many epochs: its track, predictions, health, set-back clocks, the words of its verdicts."""

from __future__ import annotations

import math

import numpy as np
import pytest

from detection import (
    Classification,
    DetectionInputError,
    Detector,
    DetectorSettings,
    OdometryCondition,
    OdometryIncrement,
    PlanningStatus,
    RangingAnchor,
    Rejection,
    Say,
    Sight,
    Witness,
    detect_epoch,
)
from tests.detection.worlds import ROVER_M, STEP_M, Floats, drive, drones, heard, named, off_m


def test_the_track_is_better_than_single_epochs_and_knows_how_good_it_is() -> None:
    anchors = drones(6)
    detector = Detector(anchors)
    answers = drive(detector, anchors, range(80), noise=np.random.default_rng(1))
    errors_m = [off_m(answer, k) for k, answer in enumerate(answers)]
    # six such drones leave one epoch 0.15 m, most of it upright
    assert np.sqrt(np.mean(np.square(errors_m[20:]))) < 0.12
    last = answers[-1].position
    assert last is not None
    assert errors_m[-1] < 4.0 * math.sqrt(float(np.trace(last.covariance_m2)))
    state = detector.state
    assert state.position_m is not None
    assert state.velocity_m_per_s == pytest.approx((1.2, 0.5, 0.0), abs=0.3)
    assert state.epochs == 80


def test_an_anchor_that_becomes_occluded_is_told_by_track_and_geometry_and_cleared_after() -> None:
    anchors = drones(6)
    detector = Detector(anchors)
    drive(detector, anchors, range(30))
    hidden = drive(detector, anchors, range(30, 50), {"D4": 2.0})
    assert [answer.excluded for answer in hidden] == [("D4",)] * 20
    assert {answer.planning for answer in hidden} == {PlanningStatus.DEGRADED}
    spoken = {say.witness: say.says for say in hidden[-1].verdicts[3].says}
    assert spoken[Witness.GEOMETRY] is spoken[Witness.MOTION] is Say.OCCLUDED
    assert hidden[-1].verdicts[3].excess_m == pytest.approx(2.0, abs=0.1)
    assert max(off_m(answer, 30 + k) for k, answer in enumerate(hidden)) < 0.1
    clear = drive(detector, anchors, range(50, 60))
    assert [answer.excluded for answer in clear] == [()] * 10
    state = next(anchor for anchor in detector.state.anchors if anchor.anchor_id == "D4")
    assert (state.sight, state.ranges) == (Sight.CLEAR, 60)
    assert state.occluded_share == pytest.approx(20 / 60)


def test_one_range_too_many_is_enough_once_there_is_a_track() -> None:
    """Four drones alone cannot tell which of them is occluded; with a track they can."""
    anchors = drones(4)
    alone = detect_epoch(anchors, heard(0.0, named(anchors, ROVER_M, {"D2": 3.0})))
    assert alone.classification is Classification.UNDETERMINED
    assert alone.needed
    detector = Detector(anchors)
    drive(detector, anchors, range(30))
    answers = drive(detector, anchors, range(30, 40), {"D2": 3.0})
    assert {answer.excluded for answer in answers} == {("D2",)}
    assert {answer.needed for answer in answers} == {""}


def test_fewer_ranges_than_unknowns_are_still_judged_by_the_track() -> None:
    anchors = drones(6)
    detector = Detector(anchors)
    drive(detector, anchors, range(30))
    answers = drive(detector, anchors, range(30, 34), {"D1": 2.0}, silent=("D3", "D4", "D5", "D6"))
    assert answers[0].excluded == ("D1",)
    assert answers[0].included == ("D2",)
    assert off_m(answers[-1], 33) < 0.3


def test_single_ranges_one_after_the_other_make_a_track_too() -> None:
    anchors = drones(6)
    detector = Detector(anchors)
    answer = None
    for number in range(240):
        anchor = anchors[number % 6]
        ranges_m = named([anchor], ROVER_M + 0.02 * number * STEP_M, {"D4": 2.0} if number > 150 else None)
        answer = detector.process(heard(0.02 * number, ranges_m))
        if number > 180:
            assert answer.excluded == (("D4",) if anchor.id == "D4" else ())
    assert answer is not None
    assert answer.position is not None
    assert np.linalg.norm(answer.position.position_m - (ROVER_M + 0.02 * 239 * STEP_M)) < 0.2


def test_a_prediction_settles_what_the_ranges_leave_open() -> None:
    """Any of the four may be too long; the map expects one of them hidden and all others in sight."""
    anchors = drones(5)
    open_, settled = 0, 0
    for number in range(30):
        place_m = ROVER_M + number * np.array([7.0, -3.0, 0.0])
        ranges_m = named(anchors, place_m, {"D2": 0.45})
        if detect_epoch(anchors, heard(0.0, ranges_m)).classification is not Classification.UNDETERMINED:
            continue
        open_ += 1
        told = detect_epoch(anchors, heard(0.0, ranges_m, None, D1=0.99, D2=0.02, D3=0.99, D4=0.99, D5=0.99))
        settled += told.excluded == ("D2",)
        spoken = told.verdicts[1].says[3]
        assert (spoken.witness, spoken.says) == (Witness.PREDICTION, Say.OCCLUDED)
        assert "a probability of sight of 2% was predicted" in spoken.reason
    assert open_ >= 5
    assert settled >= 0.6 * open_


def test_a_prediction_does_not_overrule_what_the_ranges_say_clearly() -> None:
    anchors = drones(6)
    answer = detect_epoch(anchors, heard(0.0, named(anchors, ROVER_M, {"D4": 3.0}), None, D4=0.97, D1=0.05))
    assert answer.excluded == ("D4",)


def test_every_verdict_says_in_words_what_each_witness_said() -> None:
    anchors = drones(6)
    detector = Detector(anchors)
    still = OdometryIncrement(0.1, (0.0, 0.0))
    for number in range(20):
        ranges_m = named(anchors, ROVER_M, {"D4": 2.0} if number >= 12 else None)
        answer = detector.process(heard(0.1 * number, ranges_m, still, D4=0.2))
    hidden, clear = answer.verdicts[3], answer.verdicts[0]
    assert [say.witness for say in hidden.says] == list(Witness)
    assert hidden.reason.startswith("D4 is occluded. Geometry: it misses by +2.00 m the point where 5 others meet;")
    assert "odometry: it is 2.0" in hidden.reason
    assert "the track: it is +2.0" in hidden.reason
    assert "the prediction: a probability of sight of 20% was predicted" in hidden.reason
    assert clear.reason.startswith("D1 is clear. Geometry: it meets")
    assert answer.summary == "6 ranges, occluded: D4; position: degraded."
    assert answer.odometry is OdometryCondition.RELIABLE


def test_a_range_that_is_too_short_is_left_out_and_not_explained_by_an_occlusion() -> None:
    anchors = drones(6)
    short, long = (detect_epoch(anchors, heard(0.0, named(anchors, ROVER_M, {"D4": by}))) for by in (-3.0, 3.0))
    assert short.excluded == long.excluded == ("D4",)
    assert "3.00 m too short, which no occlusion explains" in short.verdicts[3].reason
    assert "too short" not in long.verdicts[3].reason


def test_odometry_that_lies_about_everything_does_not_condemn_all_anchors() -> None:
    """A rover carried away on a truck: wheels stand still, all ranges change, and they still meet."""
    anchors = drones(6)
    detector = Detector(anchors, DetectorSettings(max_speed_m_per_s=40.0, acceleration_m_per_s2=10.0))
    still = OdometryIncrement(1.0, (0.0, 0.0))
    for number in range(12):
        answer = detector.process(heard(float(number), named(anchors, ROVER_M + number * 5.0 * STEP_M), still))
        assert answer.excluded == ()
    assert answer.classification is Classification.NONE


def test_systematic_odometry_failure_is_warned_of() -> None:
    anchors = drones(5)
    detector = Detector(anchors)
    turning = OdometryIncrement(1.0, (2.0, 0.0), (0.0, 0.0, 0.0))
    for number in range(25):
        answer = detector.process(heard(float(number), named(anchors, ROVER_M), turning))
    assert answer.odometry is OdometryCondition.STUCK
    health = detector.state.health
    assert health.odometry_failures == 1.0
    assert "Odometry fails systematically" in health.warnings[0]


def test_sensitive_settings_flag_what_relaxed_ones_tolerate() -> None:
    anchors = drones(8)
    epoch = heard(0.0, named(anchors, ROVER_M, {"D4": 0.42}))
    sensitive = detect_epoch(anchors, epoch, DetectorSettings(terrain="complex", criticality="high"))
    relaxed = detect_epoch(anchors, epoch, DetectorSettings(terrain="open", criticality="low"))
    assert sensitive.excluded == ("D4",)
    assert relaxed.excluded == ()


def test_a_fast_rover_with_unsure_clocks_tolerates_more() -> None:
    """0.4 m is much for a rover that stands, and little for one whose clocks leave 10 m/s times 0.05 s open."""
    anchors = drones(8)
    flagged = []
    for speed in (0.0, 10.0):
        detector = Detector(anchors, DetectorSettings(time_sigma_s=0.05, max_speed_m_per_s=30.0))
        for number in range(30):
            ranges_m = named(anchors, ROVER_M + number * 0.1 * speed * np.array([1.0, 0.0, 0.0]), {"D4": 0.4})
            answer = detector.process(heard(0.1 * number, ranges_m))
        flagged.append(answer.excluded)
    assert flagged == [("D4",), ()]


def test_a_known_start_begins_a_track_with_too_few_anchors() -> None:
    anchors = drones(2)
    settings = DetectorSettings(start_m=tuple(ROVER_M.tolist()), start_sigma_m=0.05, max_speed_m_per_s=2.0)
    detector = Detector(anchors, settings)
    drive(detector, anchors, range(5))
    answer = drive(detector, anchors, range(5, 10), {"D2": 3.0})[-1]
    assert answer.excluded == ("D2",)


def test_a_sender_whose_clock_was_set_back_is_followed_after_ten_epochs() -> None:
    anchors = drones(6)
    detector = Detector(anchors)
    drive(detector, anchors, range(1000, 1010))
    answers = drive(detector, anchors, range(30))
    assert {answer.rejection for answer in answers[:9]} == {Rejection.LATE}
    assert {answer.rejection for answer in answers[9:]} == {None}
    assert off_m(answers[-1], 29) < 0.1


def test_after_a_long_silence_the_track_begins_anew() -> None:
    anchors = drones(6)
    detector = Detector(anchors)
    drive(detector, anchors, range(10))
    answer = drive(detector, anchors, range(900, 901))[0]  # 80 s later, 117 m on
    assert answer.excluded == ()
    assert off_m(answer, 900) < 0.1


def test_a_track_that_follows_a_phantom_is_given_up() -> None:
    """Carried elsewhere in an instant: all ranges meet, but not where the track leads."""
    anchors = drones(8)
    detector = Detector(anchors)
    drive(detector, anchors, range(20))
    for number in range(20, 40):
        answer = detector.process(heard(0.1 * number, named(anchors, ROVER_M + np.array([60.0, 80.0, 0.0]))))
    assert answer.excluded == ()
    assert answer.position is not None
    assert answer.position.position_m == pytest.approx(ROVER_M + np.array([60.0, 80.0, 0.0]), abs=0.2)


@pytest.mark.parametrize("dimension", [2, 3])
def test_two_dimensions_work_like_three(dimension: int) -> None:
    anchors = [RangingAnchor(a.id, a.east_m, a.north_m, a.altitude_m if dimension == 3 else 0.0) for a in drones(6)]
    place_m: Floats = np.append(ROVER_M[:2], 2.0 if dimension == 3 else 0.0)
    detector = Detector(anchors, DetectorSettings(dimension=2 if dimension == 2 else 3))
    for number in range(10):
        answer = detector.process(heard(0.1 * number, named(anchors, place_m, {"D5": 3.0})))
    assert answer.excluded == ("D5",)
    assert answer.position is not None
    assert answer.position.position_m == pytest.approx(place_m[:dimension], abs=0.02)
    assert answer.position.covariance_m2.shape == (dimension, dimension)


def test_anchors_that_share_an_id_or_are_too_many_are_refused() -> None:
    with pytest.raises(DetectionInputError, match="repeated: D1"):
        Detector([*drones(2), drones(1)[0]])
    with pytest.raises(DetectionInputError, match="at most 62 anchors"):
        Detector([RangingAnchor(f"A{i}", float(i), 0.0) for i in range(63)])


@pytest.mark.parametrize("too_long_m", [0.6, 5.0, 60.0, 900.0])
def test_a_range_that_is_far_too_long_does_not_pull_the_track_along(too_long_m: float) -> None:
    """One anchor after the other, so that each range is judged by the track alone."""
    anchors = drones(5)
    detector = Detector(anchors)
    for number in range(400):
        anchor = anchors[number % 5]
        hidden = {"D2": too_long_m} if number > 250 else None
        ranges_m = named([anchor], ROVER_M + 0.05 * number * STEP_M, hidden)
        answer = detector.process(heard(0.05 * number, ranges_m))
        if number > 260:
            assert answer.excluded == (("D2",) if anchor.id == "D2" else ())
            assert answer.position is not None
            assert np.linalg.norm(answer.position.position_m - (ROVER_M + 0.05 * number * STEP_M)) < 0.4
