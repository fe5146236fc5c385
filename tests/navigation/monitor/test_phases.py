"""Differences of carrier phase in time: what they measure, with which sign, and what a filter foretells of them."""

import numpy as np
import pytest

from navigation import MeasurementError, StateError
from navigation.monitor import difference_covariance, phase_differences, phase_rows, prediction_check

SATELLITES_M = 2.66e7 * np.array(
    [(0.3, 0.5, 0.81), (-0.7, 0.1, 0.707), (0.1, -0.8, 0.59), (0.9, 0.2, 0.39), (-0.4, -0.5, 0.77)]
)


def phases_m(receivers_m, satellites_m, clocks_m):
    """Geometry and clock, to the last digit."""
    return np.linalg.norm(satellites_m - receivers_m[:, None], axis=2) + clocks_m[:, None]


def test_a_receivers_own_move_is_left_with_the_sign_that_a_numerical_derivative_has():
    speeds = np.array([(900.0, 2500.0, -300.0)] * 5) * np.array([1.0, -1.0, 0.5, 0.7, -0.6])[:, None]
    satellites = np.stack([SATELLITES_M, SATELLITES_M + speeds])
    receivers = np.array([(10.0, 20.0, 6.371e6), (13.0, 18.0, 6.371e6 + 0.5)])
    clocks = np.array([100.0, 107.0])
    changes, units = phase_differences(phases_m(receivers, satellites, clocks), satellites, receivers)
    move = np.array([3.0, -2.0, 0.5, 7.0])
    np.testing.assert_allclose(changes[0], phase_rows(units)[0] @ move, atol=1e-5)
    step = 1e-2 * np.eye(3)
    slopes = [
        (
            phases_m(receivers[1:] + s, satellites[1:], clocks[1:])
            - phases_m(receivers[1:] - s, satellites[1:], clocks[1:])
        )[0]
        / 2e-2
        for s in step
    ]
    np.testing.assert_allclose(phase_rows(units)[0, :, :3], np.stack(slopes, axis=1), atol=1e-5)


def test_neighbouring_differences_share_a_phase():
    rng = np.random.default_rng(0)
    made = np.diff(rng.normal(0.0, 0.003, (200_000, 5)), axis=1)
    np.testing.assert_allclose(np.cov(made.T), difference_covariance(0.003, 4), atol=3e-7)


def test_the_inertial_check_keeps_what_normal_numbers_keep():
    rng = np.random.default_rng(1)
    root = rng.normal(0.0, 0.01, (5, 5))
    covariance, rows = root @ root.T, rng.normal(size=(4, 5))
    errors = rng.normal(size=(20_000, 5)) @ root.T
    noise = np.diff(rng.normal(0.0, 0.03, (20_000, 4, 2)), axis=2)[..., 0]
    kept = [
        prediction_check(rows @ e + v, rows, covariance, 0.03, differences=True)
        for e, v in zip(errors, noise, strict=True)
    ]
    assert np.mean(kept) == pytest.approx(0.9973, abs=0.0012)
    single = [
        prediction_check(rows @ e + v, rows, covariance, 0.03, differences=False)
        for e, v in zip(errors, noise, strict=True)
    ]
    assert np.mean(single) < 0.992


def test_what_is_not_measured_is_never_good():
    assert list(prediction_check([0.0, np.nan], np.eye(2), np.eye(2), 1.0, differences=True)) == [True, False]


def test_bad_phases_and_covariances_are_refused():
    with pytest.raises(MeasurementError, match="two epochs"):
        phase_differences(np.zeros((1, 5)), SATELLITES_M[None], np.zeros(3))
    with pytest.raises(StateError, match="not positive"):
        prediction_check([0.0], [[1.0, 0.0]], -np.eye(2), 1.0, differences=True)
