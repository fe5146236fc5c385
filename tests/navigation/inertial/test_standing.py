"""Standing still, told from readings alone."""

import numpy as np
import pytest

from navigation import MeasurementError
from navigation.inertial import StandstillRule, imu_log, standing_still

TIMES_S = np.arange(0.0, 30.0, 0.01)


def stop_and_go(rng):
    """Ten seconds of driving between two of standing, on biased readings."""
    shakes = np.where((TIMES_S > 10.0) & (TIMES_S < 20.0), 0.5, 0.01)[:, None]
    forces = np.array([0.3, -0.2, 9.9]) + shakes * rng.normal(size=(len(TIMES_S), 3))
    return forces, 0.01 + 0.02 * shakes * rng.normal(size=(len(TIMES_S), 3))


def test_standing_is_told_from_driving_whatever_the_biases():
    forces, rates = stop_and_go(np.random.default_rng(0))
    still = standing_still(imu_log(TIMES_S, forces, rates))
    driven = (TIMES_S > 10.0) & (TIMES_S < 20.0)
    assert not still[driven].any()
    assert still[~driven].mean() > 0.98


def test_a_steady_turn_is_no_standstill_and_neither_is_a_gap():
    forces, rates = stop_and_go(np.random.default_rng(1))
    assert not standing_still(imu_log(TIMES_S, forces, rates + np.array([0.0, 0.0, 0.2]))).any()
    kept = np.r_[:300, 500 : len(TIMES_S)]
    log = imu_log(TIMES_S[kept], forces[kept], rates[kept])
    still = standing_still(log)
    assert log.gaps[300]
    assert not still[300]


def test_a_log_shorter_than_the_window_tells_nothing_and_a_rule_needs_limits():
    assert not standing_still(imu_log(TIMES_S[:5], np.tile([0.0, 0.0, 9.8], (5, 1)), np.zeros((5, 3)))).any()
    with pytest.raises(MeasurementError, match="above zero"):
        StandstillRule(window_s=0.0)
