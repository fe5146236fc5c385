"""The error state: numerical derivatives, errors against perturbed runs, and what is promised against the truth."""

import math

import numpy as np
import pytest

from gnss import ReceiverClock
from navigation import Verdict, mean_bounds, nees
from navigation.inertial import (
    ImuNoise,
    InertialStart,
    TangentFrame,
    ground_heights,
    imu_log,
    join,
    matrices_of,
    navigate,
    position_fixes,
    ranges_to_anchors,
    standstill,
    vehicle_speeds,
    velocity_fixes,
)
from navigation.inertial.kernels import corrections, strapdown
from navigation.inertial.kernels import error_state as kernel
from tests.reference.inertial import Drive, along

FRAME = TangentFrame(0.6, 0.0, 100.0)
RATE = FRAME.body.rate_rad_per_s * np.array([0.0, math.cos(0.6), math.sin(0.6)])
NOISE = ImuNoise(0.003, 2e-4, 0.05, 0.002, force_scale=0.001, rate_scale=0.001)
ANCHORS_M = np.array([(800.0, 300.0, 250.0), (-600.0, 500.0, 300.0), (100.0, -900.0, 200.0), (-300.0, -400.0, 400.0)])


def gravity(positions_m):
    return along(FRAME.gravity_m_per_s2, positions_m)


@pytest.fixture(scope="module")
def drive():
    made = Drive(11, 120.0)
    return made, *made.readings(gravity, RATE)


def begin(drive, **more):
    return InertialStart(
        drive.position(0.0), drive.velocity(0.0), np.roll(drive.attitude(np.zeros(1)).as_quat()[0], 1), **more
    )


def moved(belief, layout, place, step):
    """The belief with one error of its state put right by ``step``."""
    copy = kernel.Belief(*(np.array(field) for field in belief))
    gain = np.zeros(len(belief.covariance))
    gain[place] = 1.0
    corrections._feed_back.py_func(copy, layout, gain, step, np.zeros(len(gain)))
    return copy


KINDS = ("COORDINATE", "RATE", "RANGE", "ALONG", "PSEUDORANGE", "PHASE_CHANGE")


@pytest.mark.parametrize("late_s", [0.0, 0.004])
@pytest.mark.parametrize("kind", KINDS)
def test_rows_are_numerical_derivatives(kind, late_s):
    rng = np.random.default_rng(KINDS.index(kind))
    start = InertialStart(
        rng.normal(0.0, 50.0, 3),
        rng.normal(0.0, 5.0, 3),
        rng.normal(size=4),
        lever_arm_m=(0.4, -1.2, 0.7),
        lever_arm_sigma_m=0.1,
        clock=ReceiverClock.of_ranges(300.0, 2.0),
        phases=True,
    )
    belief, layout = start.belief(NOISE)
    belief.kept_m[:], belief.kept_clock_m[:] = rng.normal(0.0, 50.0, 3), 290.0
    turned = rng.normal(size=4)
    belief.kept_quaternion[:] = turned / np.linalg.norm(turned)
    far = kind in ("RANGE", "PSEUDORANGE", "PHASE_CHANGE")
    vector, turn = rng.normal(0.0, 90.0 if far else 1.0, 3), rng.normal(0.0, 0.5, 3)
    second = rng.normal(0.0, 90.0 if kind == "PHASE_CHANGE" else 0.5, 3)
    row, ignored, vectors = np.zeros(33), np.zeros(33), (vector, second, late_s)
    number = getattr(corrections, kind)
    corrections.expected(number, vectors, belief, turn, layout, row)
    for place in range(33):
        up = corrections.expected(number, vectors, moved(belief, layout, place, 1e-5), turn, layout, ignored)
        down = corrections.expected(number, vectors, moved(belief, layout, place, -1e-5), turn, layout, ignored)
        assert row[place] == pytest.approx((up - down) / 2e-5, abs=1e-6), place


def test_what_is_kept_is_off_by_what_the_present_is():
    rng = np.random.default_rng(4)
    start = InertialStart(
        np.zeros(3), (3.0, 4.0, 0.0), (1.0, 0.0, 0.0, 0.0), clock=ReceiverClock.of_ranges(300.0, 2.0), phases=True
    )
    belief, layout = start.belief(NOISE)
    table = rng.normal(size=(30, 30))
    belief.covariance[:] = table @ table.T
    before, transition = belief.covariance.copy(), np.eye(30)
    kernel.keep(belief, transition, layout, 0.5)
    np.testing.assert_allclose(belief.covariance, transition @ before @ transition.T)
    np.testing.assert_allclose(belief.kept_m, [-1.5, -2.0, 0.0])
    assert belief.kept_clock_m == pytest.approx(299.0)
    assert not np.allclose(transition, np.eye(30))


@pytest.mark.parametrize("place", range(21))
def test_an_error_at_the_beginning_grows_as_the_covariance_says(drive, place):
    made, forces, rates = drive
    steps = 4000
    log = imu_log(made.times_s[:steps], forces[:steps], rates[:steps])
    plain, layout = begin(made).belief(NOISE)
    size = [1e-2, 1e-3, 1e-5, 1e-4, 1e-6, 1e-5, 1e-6][place // 3]
    off = moved(plain, layout, place, size)
    ends = []
    for belief in (plain, off):
        quiet = kernel.Noise(*[0.0] * 10)
        covariance = np.zeros((21, 21))
        covariance[place, place] = 1.0
        belief.covariance[:] = covariance
        _run(log, belief, layout, quiet)
        ends.append(belief)
    before, after = ends
    told = np.concatenate([after.position_m - before.position_m, after.velocity - before.velocity])
    turn = 0.5 * _turn(before.quaternion, after.quaternion)
    # with one error alone the covariance is that error's column times itself
    column = before.covariance[:, place] / math.sqrt(before.covariance[place, place])
    np.testing.assert_allclose(told, size * column[:6], rtol=0.02, atol=0.01 * np.abs(told).max())
    np.testing.assert_allclose(turn, size * column[6:9], rtol=0.02, atol=0.01 * max(np.abs(turn).max(), 1e-9))


def _turn(first, second):
    difference = matrices_of(second) @ matrices_of(first).T
    return np.array(
        [difference[2, 1] - difference[1, 2], difference[0, 2] - difference[2, 0], difference[1, 0] - difference[0, 1]]
    )


def _run(log, belief, layout, noise):
    planet = FRAME.planet()
    before = np.zeros((2, 3))
    for k in range(1, len(log.times_s)):
        step_s = log.times_s[k] - log.times_s[k - 1]
        reading = np.stack([log.forces_m_per_s2[k], log.rates_rad_per_s[k]])
        used = reading - belief.sensors[:2] - belief.sensors[2:] * reading
        rows, matrix, force = np.zeros((9, 21)), np.zeros((3, 3)), np.zeros(3)
        strapdown.matrix_of(belief.quaternion, matrix)
        strapdown.rotate(matrix, used[0], force)
        kernel.linear(force, belief, reading, layout, planet, rows)
        kernel.grow(belief.covariance, np.zeros((0, 0)), rows, step_s, noise, layout, False)
        strapdown.step(
            (belief.position_m, belief.velocity, belief.quaternion), used[0], used[1], before, step_s, planet
        )


def simulated(seed, duration_s=100.0):
    """(log, measurements, start, drive, error of the start) of one drive with everything wrong as stated."""
    rng = np.random.default_rng(seed)
    made = Drive(1000 + seed, duration_s)
    forces, rates = made.readings(gravity, RATE)
    steps = len(made.times_s)
    bias = rng.normal(0.0, NOISE.force_bias_m_per_s2, 3), rng.normal(0.0, NOISE.rate_bias_rad_per_s, 3)
    scale = rng.normal(0.0, NOISE.force_scale, 3), rng.normal(0.0, NOISE.rate_scale, 3)
    white = NOISE.velocity_walk_m_per_s_sqrt_s / 0.005**0.5, NOISE.angle_walk_rad_per_sqrt_s / 0.005**0.5
    forces = (forces + bias[0] + rng.normal(0.0, white[0], (steps, 3))) / (1.0 - scale[0])
    rates = (rates + bias[1] + rng.normal(0.0, white[1], (steps, 3))) / (1.0 - scale[1])
    attitude = made.attitude(np.zeros(1)).as_matrix()[0]
    turn = rng.normal(0.0, 0.01, 3)
    quaternion, part, whole = np.roll(made.attitude(np.zeros(1)).as_quat()[0], 1), np.empty(4), np.empty(4)
    strapdown.quaternion_of(turn, part)
    strapdown.turned(part, quaternion, whole)
    lever = np.array([0.3, -0.4, 1.1])
    arm = lever + rng.normal(0.0, 0.1, 3)
    start = InertialStart(
        made.position(0.0) + rng.normal(0.0, 2.0, 3),
        made.velocity(0.0) + rng.normal(0.0, 0.2, 3),
        whole,
        position_sigma_m=2.0,
        velocity_sigma_m_per_s=0.2,
        attitude_sigma_rad=0.01,
        lever_arm_m=arm,
        lever_arm_sigma_m=0.1,
    )
    assert attitude.shape == (3, 3)
    at = np.arange(0.5, duration_s, 0.5)
    antenna = made.position(at) + made.attitude(at).apply(lever)
    fixes = position_fixes(at, antenna + rng.normal(0.0, 1.0, (len(at), 3)), 1.0)
    which = rng.integers(0, 4, len(at))
    ranges = np.linalg.norm(antenna - ANCHORS_M[which], axis=1) + rng.normal(0.0, 0.3, len(at))
    measured = join(fixes, ranges_to_anchors(at, ANCHORS_M[which], ranges, 0.3))
    return imu_log(made.times_s, forces, rates), measured, start, made, np.concatenate([*bias, *scale])


def test_what_is_promised_holds_over_fifty_drives_and_the_smoother_promises_more_and_holds_it():
    squares, smoothed_squares, sensors, better = [], [], [], []
    for seed in range(50):
        log, measured, start, made, errors = simulated(seed, 60.0)
        track = navigate(log, start, measured, NOISE, FRAME, smoother=True)
        truth = made.position(log.times_s)
        squares.append(nees(truth[-1] - track.position_m[-1], track.position_covariance_m2[-1]))
        smooth = track.smoothed
        middle = len(smooth.reading) // 2
        off = truth[smooth.reading[middle]] - smooth.position_m[middle]
        smoothed_squares.append(nees(off, smooth.position_covariance_m2[middle]))
        better.append(smooth.sigmas[middle, :9] < track.sigmas[smooth.reading[middle], :9])
        estimated = np.concatenate(
            [track.force_bias_m_per_s2[-1], track.rate_bias_rad_per_s[-1], track.force_scale[-1], track.rate_scale[-1]]
        )
        sensors.append(nees(errors - estimated, track.covariance[9:21, 9:21]))
    for found, degrees in ((squares, 3), (smoothed_squares, 3), (sensors, 12)):
        low, high = mean_bounds(degrees, 50, 0.95)
        assert low < np.mean(found) < high
    assert np.mean(better) > 0.99


def test_every_kind_of_measurement_leads_back_to_the_truth(drive):
    made, forces, rates = drive
    log = imu_log(made.times_s, forces, rates)
    at = np.arange(0.25, 119.0, 0.25)
    place, velocity = made.position(at), made.velocity(at)
    forward = made.attitude(at).inv().apply(velocity)[:, 0]
    start = begin(made, position_sigma_m=5.0, velocity_sigma_m_per_s=1.0)
    off = InertialStart(
        start.position_m + np.array([4.0, -3.0, 2.0]), start.velocity_m_per_s, start.quaternion, 5.0, 1.0, 0.02
    )
    ways = {
        "fixes": join(position_fixes(at, place, 0.1)),
        "velocities and one fix": join(position_fixes(at[:1], place[:1], 0.1), velocity_fixes(at, velocity, 0.01)),
        "ranges": ranges_to_anchors(
            at,
            ANCHORS_M[np.arange(len(at)) % 4],
            np.linalg.norm(place - ANCHORS_M[np.arange(len(at)) % 4], axis=1),
            0.1,
        ),
        "odometer, ground and one fix": join(
            position_fixes(at[:1], place[:1], 0.1),
            vehicle_speeds(at, forward, 0.01, sideways_sigma_m_per_s=0.01),
            ground_heights(at, place[:, 2], 0.1),
        ),
    }
    for way, measured in ways.items():
        track = navigate(log, off, measured, NOISE, FRAME)
        assert np.linalg.norm(track.position_m[-1] - made.position(log.times_s[-1])) < 0.7, way
        assert (track.verdict == Verdict.USED).all(), way


def test_a_vehicle_that_stands_stays(drive):
    times = np.arange(0.0, 60.0, 0.01)
    rng = np.random.default_rng(0)
    forces = np.tile(-FRAME.gravity_m_per_s2() + np.array([0.03, -0.02, 0.04]), (len(times), 1)) + rng.normal(
        0.0, 0.03, (len(times), 3)
    )
    rates = np.tile(RATE + np.array([0.001, 0.0, -0.001]), (len(times), 1)) + rng.normal(0.0, 0.002, (len(times), 3))
    start = InertialStart(np.zeros(3), np.zeros(3), (1.0, 0.0, 0.0, 0.0), 0.01, 0.01)
    free = navigate(imu_log(times, forces, rates), start, join(), NOISE, FRAME)
    still = navigate(imu_log(times, forces, rates), start, standstill(np.arange(0.1, 59.9, 0.1)), NOISE, FRAME)
    assert np.linalg.norm(still.position_m[-1]) < 0.15
    assert np.linalg.norm(free.position_m[-1]) > 20.0


def test_ranges_that_the_map_does_not_foresee_are_left_out_and_doubtful_ones_weigh_less(drive):
    made, forces, rates = drive
    log = imu_log(made.times_s, forces, rates)
    at = np.arange(0.25, 119.0, 0.25)
    which = np.arange(len(at)) % 4
    ranges = np.linalg.norm(made.position(at) - ANCHORS_M[which], axis=1)
    ranges[which == 2] += 40.0
    seen = np.where(which == 2, 0.02, 1.0)
    foreseen = navigate(
        log, begin(made), ranges_to_anchors(at, ANCHORS_M[which], ranges, 0.3, sight=seen), NOISE, FRAME
    )
    blind = navigate(log, begin(made), ranges_to_anchors(at, ANCHORS_M[which], ranges, 0.3), NOISE, FRAME)
    truth = made.position(log.times_s[-1])
    assert (foreseen.verdict[which == 2] == Verdict.LEFT_OUT).all()
    assert np.linalg.norm(foreseen.position_m[-1] - truth) < 2.0 < np.linalg.norm(blind.position_m[-1] - truth)
    half = ranges_to_anchors(at[:1], ANCHORS_M[:1], ranges[:1], 0.3, sight=0.5)
    assert half.variances[0] == pytest.approx(0.18)


def test_a_gate_keeps_a_jump_out_and_comes_back_where_it_was_wrong(drive):
    made, forces, rates = drive
    log = imu_log(made.times_s, forces, rates)
    at = np.arange(0.25, 119.0, 0.25)
    jumped = made.position(at)
    jumped[100:102] += 300.0
    track = navigate(log, begin(made), position_fixes(at, jumped, 0.5, gate_sigma=5.0), NOISE, FRAME)
    assert np.count_nonzero(track.verdict == Verdict.GATED) == 6
    lost = InertialStart(
        begin(made).position_m + np.array([500.0, 0.0, 0.0]), begin(made).velocity_m_per_s, begin(made).quaternion, 1.0
    )
    back = navigate(log, lost, position_fixes(at, made.position(at), 0.5, gate_sigma=5.0), NOISE, FRAME)
    assert (back.verdict == Verdict.REACQUIRED).any()
    assert np.linalg.norm(back.position_m[-1] - made.position(log.times_s[-1])) < 2.0
