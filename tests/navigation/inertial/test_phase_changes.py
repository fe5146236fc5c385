"""Changes of carrier phase in the inertial filter: what they hold and are worth, and that they promise no more."""

import math

import numpy as np
import pytest

from gnss import ReceiverClock
from navigation import MeasurementError, StateError, Verdict, mean_bounds, nees
from navigation.inertial import (
    ClockNoise,
    ImuNoise,
    InertialStart,
    TangentFrame,
    imu_log,
    join,
    navigate,
    phase_changes,
    position_fixes,
    pseudoranges,
)
from tests.reference.inertial import Drive, along

FRAME = TangentFrame(0.6, 0.0, 100.0)
RATE = FRAME.body.rate_rad_per_s * np.array([0.0, math.cos(0.6), math.sin(0.6)])
NOISE = ImuNoise(0.003, 2e-4, 0.05, 0.002)
LEVER_M = np.array([0.3, -0.4, 1.1])
SIGMA_M, CYCLE_M, SATELLITES = 0.005, 0.19, 8


def sky(at_s):
    """(n, 3) satellites as they rise and set, numbers in turn; (n,) numbers."""
    number = np.tile(np.arange(SATELLITES), len(at_s) // SATELLITES)
    up = np.radians(20.0 + 7.0 * number) + 1e-4 * at_s
    azimuth = number * 2.4 + 1e-4 * at_s
    flat = np.cos(up)
    return 2.2e7 * np.stack([flat * np.sin(azimuth), flat * np.cos(azimuth), np.sin(up)], axis=1), number


def simulated(seed, duration_s=40.0, shared=True):
    """(log, times, satellites, numbers, phases, start, drive) with everything wrong as it is stated.

    shared: white phases, of which neighbouring changes share one; else the changes are white themselves, 4σ².
    """
    rng = np.random.default_rng(seed)
    made = Drive(2000 + seed, duration_s)
    forces, rates = made.readings(lambda places_m: along(FRAME.gravity_m_per_s2, places_m), RATE)
    white = NOISE.velocity_walk_m_per_s_sqrt_s / 0.005**0.5, NOISE.angle_walk_rad_per_sqrt_s / 0.005**0.5
    forces += rng.normal(0.0, NOISE.force_bias_m_per_s2, 3) + rng.normal(0.0, white[0], forces.shape)
    rates += rng.normal(0.0, NOISE.rate_bias_rad_per_s, 3) + rng.normal(0.0, white[1], rates.shape)
    at_s = np.repeat(np.arange(0.503, duration_s, 0.5), SATELLITES)
    places, number = sky(at_s)
    antenna = made.position(at_s) + made.attitude(at_s).apply(LEVER_M)
    clock_m = 300.0 + 40.0 * at_s
    noise = rng.normal(0.0, SIGMA_M, (len(at_s) // SATELLITES, SATELLITES))
    if not shared:
        noise = np.cumsum(2.0 * noise, axis=0)
    phases = np.linalg.norm(places - antenna, axis=1) + clock_m + noise.ravel() + 1000.0 * number
    start = InertialStart(
        made.position(0.0) + rng.normal(0.0, 1.0, 3),
        made.velocity(0.0) + rng.normal(0.0, 0.2, 3),
        np.roll(made.attitude(np.zeros(1)).as_quat()[0], 1),
        position_sigma_m=1.0,
        velocity_sigma_m_per_s=0.2,
        attitude_sigma_rad=1e-3,
        lever_arm_m=LEVER_M,
        clock=ReceiverClock.of_ranges(300.0, 40.0 + rng.normal(0.0, 1.0)),
        clock_noise=ClockNoise(1e-3, 1.0, 1e-4, 1e-4),
        phases=True,
    )
    return imu_log(made.times_s, forces, rates), at_s, places, number, phases, start, made


def off_m(track, made):
    return np.linalg.norm(track.position_m - made.position(track.times_s), axis=1)


@pytest.mark.parametrize("smoother", [False, True])
def test_phases_carry_a_drive_to_centimetres_from_where_it_began(smoother):
    log, at_s, places, number, phases, start, made = simulated(1)
    told = phase_changes(at_s, number, places, phases, SIGMA_M)
    track = navigate(log, start, told, NOISE, FRAME, smoother=smoother)
    free = navigate(log, start, join(), NOISE, FRAME)
    # of where it began nothing is told: that error stays
    began = start.position_m - made.position(0.0)
    drift = track.position_m - began - made.position(track.times_s)
    assert np.linalg.norm(drift[-1]) < 0.15
    assert off_m(free, made)[-1] > 10.0
    assert (track.verdict[SATELLITES:] == Verdict.USED).all()
    assert (track.verdict[:SATELLITES] == Verdict.LEFT_OUT).all()
    assert track.covariance.shape == (17, 17)
    assert track.sigmas.shape[1] == 24
    again, _ = track.end().belief(NOISE)
    assert again.covariance.shape == (24, 24)
    if smoother:
        away = track.smoothed.position_m - began - made.position(track.smoothed.times_s)
        assert np.linalg.norm(away, axis=1).max() < 0.15


def test_what_is_promised_of_changes_holds_over_thirty_drives_and_of_phases_that_they_share_more_than_that():
    for shared in (False, True):
        ends, middles = [], []
        for seed in range(30):
            log, at_s, places, number, phases, start, made = simulated(seed, 15.0, shared)
            told = phase_changes(at_s, number, places, phases, SIGMA_M)
            track = navigate(log, start, told, NOISE, FRAME, smoother=True)
            truth = made.position(log.times_s)
            ends.append(nees(truth[-1] - track.position_m[-1], track.position_covariance_m2[-1]))
            smooth = track.smoothed
            middle = len(smooth.reading) // 2
            off = truth[smooth.reading[middle]] - smooth.position_m[middle]
            middles.append(nees(off, smooth.position_covariance_m2[middle]))
        low, high = mean_bounds(3, 30, 0.99)
        for found in (ends, middles):
            assert np.mean(found) < high
            assert np.mean(found) > low or shared


def test_lost_cycles_are_not_believed_and_doubt_nothing_else():
    log, at_s, places, number, phases, start, _ = simulated(2)
    slipped = phases + CYCLE_M * ((number == 3) & (at_s > 10.0)) - 3.0 * CYCLE_M * ((number == 5) & (at_s > 20.0))
    told = phase_changes(at_s, number, places, slipped, SIGMA_M, gate_sigma=5.0)
    track = navigate(log, start, told, NOISE, FRAME)
    assert np.count_nonzero(track.verdict == Verdict.GATED) == 2
    assert not (track.verdict == Verdict.REACQUIRED).any()
    whole = navigate(log, start, phase_changes(at_s, number, places, phases, SIGMA_M), NOISE, FRAME)
    assert np.linalg.norm(track.position_m[-1] - whole.position_m[-1]) < 0.05


def test_phases_and_codes_together_smooth_what_codes_scatter():
    log, at_s, places, number, phases, start, made = simulated(3)
    rng = np.random.default_rng(3)
    codes = phases - 1000.0 * number + rng.normal(0.0, 3.0, len(phases))
    heard = pseudoranges(at_s, places, codes, 3.0)
    alone = navigate(log, start, heard, NOISE, FRAME)
    both = navigate(log, start, join(heard, phase_changes(at_s, number, places, phases, SIGMA_M)), NOISE, FRAME)
    steps = [np.diff(track.position_m - made.position(track.times_s), axis=0)[2000:] for track in (alone, both)]
    wandering = [np.linalg.norm(np.cumsum(step, axis=0).std(axis=0)) for step in steps]
    assert wandering[1] < 0.3 * wandering[0]


def test_a_change_is_that_of_one_satellite_from_one_epoch_to_the_next():
    at_s = [0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 4.0]
    number, arcs = [1, 2, 1, 2, 1, 3, 2], [0, 0, 0, 1, 1, 0, 1]
    places = np.arange(21.0).reshape(7, 3) + 1e7
    told = phase_changes(at_s, number, places, [5.0, 7.0, 5.5, 7.5, 6.5, 1.0, 8.0], 0.01, arcs=arcs)
    # 2 lost cycles at 1 s; 1 did at 2 s; 3 is new; 2 was not there at 2 s
    np.testing.assert_array_equal(told.values, [np.nan, np.nan, 0.5, np.nan, np.nan, np.nan, np.nan])
    np.testing.assert_array_equal(told.offsets_m[2], places[0])
    np.testing.assert_allclose(told.variances, 4e-4)


def test_what_makes_no_changes_is_refused():
    log, at_s, places, number, phases, start, _ = simulated(1, 2.0)
    told = phase_changes(at_s, number, places, phases, SIGMA_M)
    plain = InertialStart(np.zeros(3), np.zeros(3), (1.0, 0.0, 0.0, 0.0), clock=ReceiverClock())
    with pytest.raises(StateError, match="phases=True"):
        navigate(log, plain, told, NOISE, FRAME)
    with pytest.raises(StateError, match="receiver's clock"):
        InertialStart(np.zeros(3), np.zeros(3), (1.0, 0.0, 0.0, 0.0), phases=True).belief(NOISE)
    slow = imu_log(log.times_s[::300], log.forces_m_per_s2[::300], log.rates_rad_per_s[::300])
    inside = at_s <= slow.times_s[-1]
    few = phase_changes(at_s[inside], number[inside], places[inside], phases[inside], SIGMA_M)
    with pytest.raises(StateError, match="between two readings"):
        navigate(slow, start, few, NOISE, FRAME, smoother=True)
    with pytest.raises(MeasurementError, match="in order of time"):
        phase_changes([1.0, 0.0], [1, 1], places[:2], [0.0, 0.0], 0.01)
    with pytest.raises(MeasurementError, match="Satellite 1 has two phases"):
        phase_changes([0.0, 0.0], [1, 1], places[:2], [0.0, 0.0], 0.01)
    with pytest.raises(MeasurementError, match="whole numbers"):
        phase_changes([0.0, 1.0], [1.0, 1.0], places[:2], [0.0, 0.0], 0.01)
    with pytest.raises(MeasurementError, match="above zero"):
        phase_changes([0.0, 1.0], [1, 1], places[:2], [0.0, 0.0], 0.0)
    assert position_fixes([0.0], np.zeros((1, 3)), 1.0).kinds[0] != told.kinds[0]
