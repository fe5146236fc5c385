"""The session's filter of hypotheses: where ranges lie and nobody says which, its bubble holds."""

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
from navigation import (
    ConstantVelocityEstimator,
    HypothesesEstimator,
    MeasurementError,
    StateError,
    carry_hypotheses,
    correct_hypotheses,
    initial_state,
    linear_update,
)
from tests.navigation.test_estimators import ANCHORS, PLACES_M, SETTINGS, SPEED, epoch, place, there


def followed(kind, epochs, anchors=ANCHORS, settings=SETTINGS):
    detector, estimator = Detector(anchors, settings), kind(anchors, settings)
    answers = []
    for one in epochs:
        result = detector.process(one)
        answers.append(estimator.step(one, result, detector.motion))
    return answers


def test_exact_ranges_lead_to_the_place_and_to_the_velocity():
    last = there(followed(HypothesesEstimator, [epoch(second) for second in range(20)])[-1])
    np.testing.assert_allclose(last.position_m, place(19), atol=0.05)
    np.testing.assert_allclose(last.velocity_m_per_s, (SPEED, 0.0, 0.0), atol=0.1)
    assert last.used == tuple(PLACES_M)


def lying(seed, count=60, changing=0.15):
    """Epochs of noisy ranges, each of which lies in a quarter of them, by 0.3 m and more; changing: 1 = by itself."""
    rng, excess = np.random.default_rng(seed), dict.fromkeys(PLACES_M, 0.0)
    epochs = []
    for second in range(count):
        for name in excess:
            if rng.random() < changing:
                excess[name] = 0.3 + rng.exponential(0.7) if rng.random() < 0.25 and second > 5 else 0.0
        epochs.append(epoch(float(second), dict(excess), noise=rng))
    return epochs


def test_the_bubble_holds_though_ranges_lie():
    held = {}
    for kind in (ConstantVelocityEstimator, HypothesesEstimator):
        inside = []
        for seed in range(4):
            answers = followed(kind, lying(seed))
            there_are = [one for one in answers[10:] if one is not None]
            inside += [np.linalg.norm(one.position_m - place(one.time_s)) <= one.bubble_m for one in there_are]
        held[kind] = np.mean(inside)
    assert held[HypothesesEstimator] >= 0.92
    assert held[HypothesesEstimator] >= held[ConstantVelocityEstimator] + 0.05


def test_the_bubble_holds_though_ranges_lie_each_by_itself():
    inside = []
    for seed in range(3):
        there_are = [one for one in followed(HypothesesEstimator, lying(seed, changing=1.0))[10:] if one is not None]
        inside += [np.linalg.norm(one.position_m - place(one.time_s)) <= one.bubble_m for one in there_are]
    assert np.mean(inside) >= 0.96


def test_what_the_map_says_of_sight_is_believed():
    def told(sight):
        epochs = [epoch(float(second), {"A4": 1.0}) for second in range(15)]
        epochs = [
            replace(one, ranges=tuple(replace(r, p_sight=sight) if r.anchor_id == "A4" else r for r in one.ranges))
            for one in epochs
        ]
        return there(followed(HypothesesEstimator, epochs)[-1])

    assert np.linalg.norm(told(0.01).position_m - place(14)) <= np.linalg.norm(told(0.99).position_m - place(14)) + 0.02
    assert "A4" not in told(0.01).used


def test_wheels_and_ground_hold_it_where_no_range_is_left():
    wheels = OdometryIncrement(1.0, (SPEED, 0.0), heading_rad=math.pi / 2.0)
    ground = GroundHeight(0.0, 0.0, 1.5, 0.0, 0.0, 0.5)
    before = [epoch(second, odometry=wheels, ground=ground) for second in range(10)]
    shadow = [epoch(second, only=(), odometry=wheels, ground=ground) for second in range(10, 25)]
    bare = [replace(one, odometry=None, ground=None) for one in shadow]
    held, loose = (there(followed(HypothesesEstimator, [*before, *some])[-1]) for some in (shadow, bare))
    np.testing.assert_allclose(held.position_m, place(24), atol=0.5)
    assert held.bubble_m < 0.5 * loose.bubble_m


def test_both_sides_of_a_plane_of_anchors_are_carried():
    flat = [RangingAnchor(name, *at[:2], 0.0) for name, at in PLACES_M.items()]

    def one(second):
        east_m, north_m, up_m = place(second)
        at = east_m, north_m, up_m + 6.0
        measured = [RangeMeasurement(a.id, math.dist(at, (a.east_m, a.north_m, a.altitude_m))) for a in flat]
        return RangeEpoch(float(second), tuple(measured))

    epochs = [one(second) for second in range(10)]
    assert followed(ConstantVelocityEstimator, epochs, flat)[-1] is None
    last = there(followed(HypothesesEstimator, epochs, flat)[-1])
    height = place(9)[2] + 6.0
    np.testing.assert_allclose(last.position_m[:2], place(9)[:2], atol=0.2)
    assert abs(last.position_m[2]) < 0.5 * height
    assert last.bubble_m > height


def test_what_is_linear_corrects_every_hypothesis_as_it_does_one():
    rng = np.random.default_rng(2)
    state = initial_state(0.0, (1.0, 2.0, 3.0))
    rows, noise, measured = rng.normal(size=(2, 6)), np.diag([0.5, 2.0]), np.array([4.0, -1.0])
    one = linear_update(state.mean, state.covariance, measured, rows, noise)
    found = correct_hypotheses(carry_hypotheses(state, 3), measured, rows, noise).state()
    np.testing.assert_allclose(found.mean, one.mean, atol=1e-9)
    np.testing.assert_allclose(found.covariance, one.covariance, atol=1e-9)
    with pytest.raises(MeasurementError, match="above zero"):
        correct_hypotheses(carry_hypotheses(state, 3), measured, rows, np.zeros((2, 2)))


def test_what_is_refused():
    with pytest.raises(StateError, match="three dimensions"):
        HypothesesEstimator(ANCHORS, DetectorSettings(dimension=2))
    with pytest.raises(StateError, match="1 to 16 anchors"):
        HypothesesEstimator([RangingAnchor(str(i), float(i), 0.0) for i in range(17)], SETTINGS)
