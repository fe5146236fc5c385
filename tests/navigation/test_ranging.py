"""The extended Kalman filter of ranges, up its ladder: Jacobian, matrices, noiseless run, order, gate, bad input."""

import math

import numpy as np
import pytest

from navigation import (
    FilterState,
    MeasurementError,
    MotionNoise,
    StateError,
    TimeOrderError,
    Verdict,
    initial_state,
    predict,
    update_range,
    update_ranges,
)
from navigation.kernels.ranges import range_row
from tests.navigation.worlds import ANCHORS_M, MOTION, belief, correlated, true_ranges_m
from tests.reference import kalman

CLOCKS = pytest.mark.parametrize("clock", [False, True], ids=["ranging", "pseudoranges"])


def psd_of(state):
    return MOTION.psd()[: len(state.mean) // 2]


@CLOCKS
def test_the_jacobian_is_that_of_finite_differences(clock):
    state = belief(clock)
    numerical = kalman.numerical_jacobian(state.mean, ANCHORS_M)
    row = np.zeros(len(state.mean))
    for anchor_m, expected in zip(ANCHORS_M, numerical, strict=True):
        range_m = range_row(state.mean, anchor_m, row)
        assert range_m == pytest.approx(np.linalg.norm(state.position_m - anchor_m) + (30.0 if clock else 0.0))
        np.testing.assert_allclose(row, expected, atol=1e-6)


@CLOCKS
def test_time_passes_as_the_printed_matrices_say(clock):
    state = correlated(belief(clock))
    later = predict(state, 2.5, MOTION)
    mean, covariance = kalman.predicted(state.mean, state.covariance, psd_of(state), 2.5)
    np.testing.assert_allclose(later.mean, mean, rtol=1e-12)
    np.testing.assert_allclose(later.covariance, covariance, rtol=1e-12, atol=1e-12)
    assert later.time_s == 2.5


@CLOCKS
def test_ranges_of_an_instant_correct_as_table_iii_says(clock):
    state = correlated(belief(clock))
    measured_m = kalman.expected_ranges(state.mean, ANCHORS_M) + np.random.default_rng(2).normal(size=len(ANCHORS_M))
    variances_m2 = np.linspace(0.5, 2.0, len(ANCHORS_M))
    update = update_ranges(state, ANCHORS_M, measured_m, variances_m2)
    h = kalman.analytic_jacobian(state.mean, ANCHORS_M)
    innovation = measured_m - kalman.expected_ranges(state.mean, ANCHORS_M)
    mean, covariance, p_zz = kalman.updated(state.mean, state.covariance, h, innovation, np.diag(variances_m2))
    np.testing.assert_allclose(update.state.mean, mean, rtol=1e-9)
    np.testing.assert_allclose(update.state.covariance, covariance, rtol=1e-9, atol=1e-9)
    assert update.nis == pytest.approx(innovation @ np.linalg.solve(p_zz, innovation))
    assert update.used == len(ANCHORS_M)


@CLOCKS
def test_without_noise_the_estimate_lands_on_the_truth(clock):
    position_m, velocity = np.array([0.0, 0.0, 30.0]), np.array([2.0, -1.0, 0.3])
    state = initial_state(0.0, (8.0, -9.0, 12.0), clock_m=(0.0, 0.0) if clock else None)
    still = MotionNoise(0.01, 0.01, 0.01, 0.01)
    for second in range(1, 61):
        here_m = position_m + velocity * second
        offset_m = 25.0 + 0.5 * second if clock else 0.0
        state = predict(state, float(second), still)
        state = update_ranges(state, ANCHORS_M, true_ranges_m(here_m, clock_m=offset_m), 0.01).state
    np.testing.assert_allclose(state.position_m, position_m + velocity * 60.0, atol=1e-3)
    np.testing.assert_allclose(state.velocity_m_per_s, velocity, atol=1e-3)
    if clock:
        np.testing.assert_allclose(state.mean[6:], [55.0, 0.5], atol=1e-2)


def test_ranges_one_by_one_at_one_instant_do_as_well_as_all_together():
    state = belief(False)
    measured_m = true_ranges_m((2.0, -3.0, 21.0))
    together = update_ranges(state, ANCHORS_M, measured_m, 0.25).state
    alone = state
    for anchor_m, range_m in zip(ANCHORS_M, measured_m, strict=True):
        alone = update_range(alone, 0.0, MOTION, anchor_m, range_m, 0.25).state
    # each is linearised where the one before has led to
    np.testing.assert_allclose(alone.mean, together.mean, atol=0.02)
    np.testing.assert_allclose(alone.covariance, together.covariance, atol=0.02)


def test_the_order_of_anchors_does_not_matter():
    state, measured_m = correlated(belief(False)), true_ranges_m((2.0, -3.0, 21.0))
    forwards = update_ranges(state, ANCHORS_M, measured_m, 0.25).state
    backwards = update_ranges(state, ANCHORS_M[::-1], measured_m[::-1], 0.25).state
    np.testing.assert_allclose(forwards.mean, backwards.mean, atol=1e-9)
    np.testing.assert_allclose(forwards.covariance, backwards.covariance, atol=1e-9)


def test_what_is_not_measured_or_left_out_changes_nothing_and_says_so():
    state, measured_m = belief(False), true_ranges_m((2.0, -3.0, 21.0))
    measured_m[1], variances_m2 = math.nan, np.full(len(ANCHORS_M), 0.25)
    variances_m2[3] = math.inf
    update = update_ranges(state, ANCHORS_M, measured_m, variances_m2)
    rest = [0, 2, 4, 5]
    fewer = update_ranges(state, ANCHORS_M[rest], measured_m[rest], 0.25)
    np.testing.assert_array_equal(update.state.covariance, fewer.state.covariance)
    assert update.verdict.tolist() == [1, 0, 1, 0, 1, 1]
    assert np.isnan(update.innovation_m[[1, 3]]).all()


def test_a_range_beyond_the_gate_is_told_and_not_believed():
    state, measured_m = belief(False), true_ranges_m((3.0, -4.0, 20.0))
    measured_m[2] += 500.0
    update = update_ranges(state, ANCHORS_M, measured_m, 0.25, gate_sigma=4.0)
    assert update.verdict[2] == Verdict.GATED
    assert update.innovation_m[2] > 400.0
    assert update.used == len(ANCHORS_M) - 1
    np.testing.assert_allclose(update.state.position_m, (3.0, -4.0, 20.0), atol=0.1)


def test_no_range_at_all_leaves_the_belief_as_it_was():
    state = belief(True)
    update = update_ranges(state, np.empty((0, 3)), [], [])
    assert math.isnan(update.nis)
    np.testing.assert_array_equal(update.state.covariance, state.covariance)


def test_an_anchor_at_the_very_place_says_nothing_of_the_position():
    state = belief(False)
    update = update_ranges(state, [state.position_m], [0.0], 0.25)
    np.testing.assert_allclose(update.state.covariance, state.covariance)


@pytest.mark.parametrize("gap_s", [1e3, 1e6, 1e9, 1e15])
@CLOCKS
def test_a_long_outage_inflates_and_ranges_bring_it_back(gap_s, clock):
    state = update_ranges(belief(clock), ANCHORS_M, true_ranges_m((3.0, -4.0, 20.0), clock_m=30.0 * clock), 0.25).state
    lost = predict(state, gap_s, MOTION)
    assert np.isfinite(lost.covariance).all()
    assert np.trace(lost.position_covariance_m2) > 100.0 * np.trace(state.position_covariance_m2)
    found = FilterState(lost.time_s, state.mean, lost.covariance)  # a mean that ranges can be linearised at
    update = update_ranges(found, ANCHORS_M, true_ranges_m((3.0, -4.0, 20.0), clock_m=30.0 * clock), 0.25)
    assert np.trace(update.state.position_covariance_m2) < 20.0


def test_times_that_go_backwards_are_refused():
    with pytest.raises(TimeOrderError, match="must not go backwards: 4"):
        predict(belief(False, time_s=5.0), 4.0, MOTION)
    with pytest.raises(TimeOrderError):
        predict(belief(False), math.nan, MOTION)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda c: c.__setitem__((0, 1), 5.0), "not symmetric"),
        (lambda c: c.__setitem__((2, 2), -1.0), "not positive"),
        (lambda c: c.__setitem__((slice(0, 2), slice(0, 2)), [[1.0, 2.0], [2.0, 1.0]]), "not positive"),
        (lambda c: c.__setitem__((0, 0), math.nan), "not finite"),
        (lambda c: c.__setitem__((slice(0, 2), slice(0, 2)), [[0.0, 1.0], [1.0, 1.0]]), "not positive"),
    ],
)
def test_a_covariance_that_is_none_is_refused(change, sentence):
    covariance = np.eye(6)
    change(covariance)
    with pytest.raises(StateError, match=sentence):
        FilterState(0.0, np.zeros(6), covariance)


def test_a_coordinate_known_for_certain_is_a_covariance():
    assert FilterState(0.0, np.zeros(6), np.diag([0.0, 1.0, 0.0, 1.0, 0.0, 1.0])).covariance[0, 0] == 0.0


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ((np.zeros(7), np.eye(7)), "6 numbers, or 8"),
        ((np.full(6, np.nan), np.eye(6)), "finite numbers"),
        ((np.zeros(6), np.eye(5)), "shape"),
        ((["a"] * 6, np.eye(6)), "must hold numbers"),
    ],
)
def test_a_state_that_is_none_is_refused(arguments, sentence):
    with pytest.raises(StateError, match=sentence):
        FilterState(0.0, *arguments)


def test_a_state_without_a_time_or_with_negative_sigmas_is_refused():
    with pytest.raises(StateError, match="time_s"):
        FilterState(math.nan, np.zeros(6), np.eye(6))
    with pytest.raises(StateError, match="zero or more"):
        initial_state(0.0, (0.0, 0.0, 0.0), position_sigma_m=-1.0)
    with pytest.raises(StateError, match="zero or more"):
        MotionNoise(east_m2_per_s3=-0.1)


@pytest.mark.parametrize(
    ("anchors_m", "measured_m", "variances_m2", "gate", "sentence"),
    [
        ([(0.0, 0.0)], [1.0], 1.0, 3.0, "one row of east, north and altitude"),
        ([(0.0, 0.0, math.nan)], [1.0], 1.0, 3.0, "three finite numbers"),
        ([(0.0, 0.0, 1.0)], [1.0, 2.0], 1.0, 3.0, "need as many"),
        ([(0.0, 0.0, 1.0)], [math.inf], 1.0, 3.0, "finite numbers, or NaN"),
        ([(0.0, 0.0, 1.0)], [1.0], 0.0, 3.0, "above zero"),
        ([(0.0, 0.0, 1.0)], [1.0], 1.0, 0.0, "gate_sigma"),
        ("here", [1.0], 1.0, 3.0, "east, north and altitude in metres"),
    ],
)
def test_what_is_no_measurement_is_refused(anchors_m, measured_m, variances_m2, gate, sentence):
    with pytest.raises(MeasurementError, match=sentence):
        update_ranges(belief(False), anchors_m, measured_m, variances_m2, gate_sigma=gate)
