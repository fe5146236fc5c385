"""The linear filter of Table III, position fixes, and a vehicle that knows its ground."""

import math

import numpy as np
import pytest

from navigation import (
    MeasurementError,
    StateError,
    linear_predict,
    linear_update,
    predict,
    update_fix,
    update_ground,
)
from tests.navigation.worlds import MOTION, belief, correlated
from tests.reference import kalman


def test_the_linear_filter_is_table_iii():
    rng = np.random.default_rng(7)
    mean, covariance = correlated(belief(False)).mean, correlated(belief(False)).covariance
    f, u = kalman.transition(6, 0.7), rng.normal(size=6)
    q = kalman.process_noise([0.2, 0.3, 0.1], 0.7)
    later_mean, later = linear_predict(mean, covariance, f, q, u)
    np.testing.assert_allclose(later_mean, f @ mean + u)
    np.testing.assert_allclose(later, f @ covariance @ f.T + q)
    h, z, r = rng.normal(size=(2, 6)), rng.normal(size=2), np.array([[2.0, 0.3], [0.3, 1.0]])
    found = linear_update(later_mean, later, z, h, r)
    mean, covariance, p_zz = kalman.updated(later_mean, later, h, z - h @ later_mean, r)
    np.testing.assert_allclose(found.mean, mean)
    np.testing.assert_allclose(found.covariance, covariance, atol=1e-12)
    np.testing.assert_allclose(found.innovation_covariance, p_zz)


@pytest.mark.parametrize("clock", [False, True], ids=["without clock", "with clock"])
def test_fixes_at_constant_velocity_lead_to_the_truth(clock):
    state = belief(clock)
    for second in range(1, 40):
        state = predict(state, float(second), MOTION)
        state = update_fix(state, (2.0 * second, -1.0 * second, 5.0), 0.01 * np.eye(3)).state
    np.testing.assert_allclose(state.position_m, (78.0, -39.0, 5.0), atol=1e-3)
    np.testing.assert_allclose(state.velocity_m_per_s, (2.0, -1.0, 0.0), atol=1e-3)


def test_a_fix_beyond_the_gate_changes_nothing_but_the_doubt():
    state = belief(False)
    found = update_fix(state, (900.0, 0.0, 0.0), np.eye(3), gate_sigma=4.0)
    assert not found.used
    np.testing.assert_array_equal(found.state.mean, state.mean)
    np.testing.assert_array_equal(found.state.covariance, state.covariance)
    assert (state.doubt, found.state.doubt) == (0.0, 3.0)
    assert found.nis > 16.0


def test_a_vehicle_on_level_ground_has_the_grounds_height():
    found = update_ground(belief(False), 33.0, sigma_m=0.01)
    assert found.state.position_m[2] == pytest.approx(33.0, abs=1e-3)
    np.testing.assert_allclose(found.state.position_m[:2], belief(False).position_m[:2])


def test_on_a_slope_the_height_is_that_of_wherever_it_turns_out_to_be():
    def ground_m(east_m, north_m):
        return 10.0 + 0.3 * east_m - 0.2 * north_m

    state = belief(False)
    east_m, north_m, _ = state.position_m
    state = update_ground(state, ground_m(east_m, north_m), (0.3, -0.2), sigma_m=0.01).state
    state = update_fix(state, (state.position_m[0] + 5.0, state.position_m[1], 0.0), np.diag([0.01, 0.01, 1e8])).state
    east_m, north_m, up_m = state.position_m
    assert up_m == pytest.approx(ground_m(east_m, north_m), abs=0.01)


@pytest.mark.parametrize(
    ("ask", "error", "sentence"),
    [
        (lambda: update_fix(belief(False), (1.0, 2.0), np.eye(3)), MeasurementError, "position_m"),
        (lambda: update_fix(belief(False), (1.0, 2.0, math.nan), np.eye(3)), MeasurementError, "finite"),
        (lambda: update_fix(belief(False), (1.0, 2.0, 3.0), -np.eye(3)), StateError, "noise is not positive"),
        (
            lambda: update_fix(belief(False), (1.0, 2.0, 3.0), np.eye(3), gate_sigma=-1.0),
            MeasurementError,
            "gate_sigma",
        ),
        (lambda: update_ground(belief(False), 3.0, sigma_m=0.0), MeasurementError, "sigma_m"),
        (lambda: linear_update(np.zeros(2), np.zeros((2, 2)), [1.0], [[1.0, 0.0]], [[0.0]]), MeasurementError, "zero"),
        (lambda: linear_predict(np.zeros(2), np.eye(2), np.eye(3), np.eye(2)), StateError, "transition"),
        (lambda: linear_predict(np.zeros(2), np.eye(2), np.eye(2), -np.eye(2)), StateError, "process_noise"),
    ],
)
def test_what_makes_no_sense_is_refused(ask, error, sentence):
    with pytest.raises(error, match=sentence):
        ask()
