"""A pose from several balls: exact where they are, with the covariance it has, and taken by the inertial filter."""

from __future__ import annotations

import numpy as np
import pytest

from navigation import MeasurementError, StateError
from navigation.inertial import EARTH, ImuNoise, InertialStart, TangentFrame, imu_log, navigate
from navigation.targets import pose_measurements, register_targets

PLACED_M = np.array([(0.0, 5.0, 0.5), (2.0, 6.0, 0.3), (-1.5, 7.0, 1.2), (0.5, 8.0, 0.0)])
POSITION_M = np.array([0.3, 1.0, 1.4])
# right, down, forward of a sensor that looks north and a little down, in east, north, up
R = np.array([(1.0, 0.0, 0.0), (0.0, -0.1, np.sqrt(0.99)), (0.0, -np.sqrt(0.99), -0.1)])
SPREADS = np.array([np.diag([1e-6, 2e-6, (0.002 * (n + 1)) ** 2]) for n in range(4)])


def seen(rng=None):
    exact = (PLACED_M - POSITION_M) @ R
    return exact if rng is None else exact + np.stack([rng.multivariate_normal(np.zeros(3), one) for one in SPREADS])


def test_balls_without_noise_give_the_pose_itself():
    pose = register_targets(seen(), SPREADS, PLACED_M)
    assert pose.position_m == pytest.approx(POSITION_M, abs=1e-9)
    assert pose.R_sensor_to_targets == pytest.approx(R, abs=1e-9)


def test_poses_are_off_as_their_covariance_says():
    rng, squares, misfits = np.random.default_rng(6), [], []
    for _ in range(400):
        pose = register_targets(seen(rng), SPREADS, PLACED_M)
        turn = R @ pose.R_sensor_to_targets.T
        rotation = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2.0
        error = np.append(POSITION_M - pose.position_m, rotation)
        squares.append(error @ np.linalg.solve(pose.covariance, error))
        misfits.append(pose.misfit)
    # six degrees of freedom: the mean of 400 has a sigma of sqrt(12/400) = 0.17; and six of misfit, over six
    assert np.mean(squares) == pytest.approx(6.0, abs=0.6)
    assert np.mean(misfits) == pytest.approx(1.0, abs=0.1)


def test_the_inertial_filter_takes_the_pose_with_its_ellipsoid():
    pose = register_targets(seen(), SPREADS, PLACED_M)
    still = np.tile([0.0, 0.0, 9.806], (101, 1))
    log = imu_log(np.linspace(0.0, 1.0, 101), still, np.zeros((101, 3)))
    start = InertialStart(POSITION_M + 3.0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), 10.0, 1e-3, 1e-4)
    noise = ImuNoise(1e-4, 1e-5, 1e-3, 1e-6)
    events = pose_measurements(0.0, pose)
    track = navigate(log, start, events, noise, TangentFrame(0.8, body=EARTH))
    assert len(events) == 3
    assert track.position_m[0] == pytest.approx(POSITION_M, abs=1e-3)
    assert track.position_covariance_m2[0] == pytest.approx(pose.covariance[:3, :3], rel=1e-2, abs=1e-9)


def test_an_arm_moves_the_place_and_takes_the_turn_with_it():
    pose = register_targets(seen(), SPREADS, PLACED_M)
    events = pose_measurements(2.0, pose, arm_m=(0.0, 0.0, 4.0))
    place = np.linalg.solve(events.vectors, events.values)
    assert place == pytest.approx(POSITION_M + R @ (0.0, 0.0, 4.0), abs=1e-9)
    # amid the balls it is known better than where the sensor is, and behind the sensor worse
    behind = pose_measurements(2.0, pose, arm_m=(0.0, 0.0, -4.0))
    assert events.variances.sum() < pose.covariance[:3, :3].trace() < behind.variances.sum()


def test_balls_that_give_no_pose_are_refused():
    with pytest.raises(MeasurementError, match="three balls or more"):
        register_targets(seen()[:2], SPREADS[:2], PLACED_M[:2])
    line = np.outer(np.arange(4.0), (1.0, 2.0, 0.5))
    with pytest.raises(MeasurementError, match="balls placed stand on one line"):
        register_targets(seen(), SPREADS, line)
    with pytest.raises(StateError, match="The covariance of ball 0 is not positive"):
        register_targets(seen(), -SPREADS, PLACED_M)
    with pytest.raises(MeasurementError, match="placed_sigma_m must be zero or more"):
        register_targets(seen(), SPREADS, PLACED_M, placed_sigma_m=-1.0)
