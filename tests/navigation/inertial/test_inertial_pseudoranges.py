"""Pseudoranges in the inertial filter: place and a receiver's clock together."""

import math

import numpy as np
import pytest

from gnss import ReceiverClock
from navigation import StateError
from navigation.inertial import (
    ClockNoise,
    ImuNoise,
    InertialStart,
    TangentFrame,
    imu_log,
    join,
    navigate,
    pseudoranges,
)
from tests.reference.inertial import Drive, along

FRAME = TangentFrame(0.6, 0.0, 100.0)
RATE = FRAME.body.rate_rad_per_s * np.array([0.0, math.cos(0.6), math.sin(0.6)])
NOISE = ImuNoise(0.003, 2e-4, 0.05, 0.002, force_scale=0.001, rate_scale=0.001)


@pytest.fixture(scope="module")
def drive():
    made = Drive(11, 120.0)
    return made, *made.readings(lambda places_m: along(FRAME.gravity_m_per_s2, places_m), RATE)


def begin(made, **more):
    attitude = np.roll(made.attitude(np.zeros(1)).as_quat()[0], 1)
    return InertialStart(made.position(0.0), made.velocity(0.0), attitude, **more)


@pytest.mark.parametrize("smoother", [False, True])
def test_pseudoranges_correct_place_and_clock_together(drive, smoother):
    made, forces, rates = drive
    rng = np.random.default_rng(6)
    log = imu_log(made.times_s, forces + 0.03, rates + 0.0005)
    up, azimuth = np.sin(np.radians(rng.uniform(15.0, 80.0, 8))), np.arange(8) * np.pi / 4.0
    flat = np.sqrt(1.0 - up**2)
    satellites = 2.2e7 * np.stack([flat * np.sin(azimuth), flat * np.cos(azimuth), up], axis=1)
    at_s = np.repeat(np.arange(1.0, made.times_s[-1]), 8)
    places = np.tile(satellites, (len(at_s) // 8, 1))
    truth = 40_000.0 + 55.0 * at_s
    measured = np.linalg.norm(made.position(at_s) - places, axis=1) + truth + rng.normal(0.0, 1.0, len(at_s))
    start = begin(made, clock=ReceiverClock(), position_sigma_m=30.0)
    told = pseudoranges(at_s, places, measured, 1.0, gate_sigma=8.0)
    track = navigate(log, start, told, NOISE, FRAME, smoother=smoother)
    late = track.times_s > 60.0
    errors = (track.position_m - made.position(track.times_s))[late]
    assert np.sqrt((errors**2).sum(axis=1).mean()) < 2.0
    assert abs(track.clock_m[-1, 0] - (40_000.0 + 55.0 * track.times_s[-1])) < 4.0 * track.sigmas[-1, -2]
    assert abs(track.clock_m[-1, 1] - 55.0) < 4.0 * track.sigmas[-1, -1]
    assert 0.5 < np.mean(track.innovation[800:] ** 2 / track.innovation_variance[800:]) < 1.5


def test_a_clock_is_told_in_seconds_at_a_time_of_the_log_and_goes_on_where_a_track_ends(drive):
    made, forces, rates = drive
    log = imu_log(made.times_s[:101] + 50.0, forces[:101], rates[:101])
    clock, noise = ReceiverClock(2e-6, 1e-7, at_s=40.0), ClockNoise(3.0, 0.2)
    track = navigate(log, begin(made, clock=clock, clock_noise=noise), join(), NOISE, FRAME)
    light = 299_792_458.0
    assert track.clock_m[0] == pytest.approx([light * 3e-6, light * 1e-7])
    assert track.sigmas[0, -2:] == pytest.approx([3.0, 0.2])
    after = track.end()
    assert after.clock.ahead_s(log.times_s[-1] + 7.0) == pytest.approx(clock.ahead_s(log.times_s[-1] + 7.0), rel=1e-9)
    assert after.clock_noise == noise


def test_pseudoranges_without_a_clock_and_clocks_that_are_none_are_refused(drive):
    made, forces, rates = drive
    told = pseudoranges([1.0], [[0.0, 0.0, 2e7]], [2e7], 1.0)
    with pytest.raises(StateError, match="receiver's clock"):
        navigate(imu_log(made.times_s, forces, rates), begin(made), told, NOISE, FRAME)
    with pytest.raises(StateError, match="offset_sigma_m"):
        ClockNoise(offset_sigma_m=0.0)
