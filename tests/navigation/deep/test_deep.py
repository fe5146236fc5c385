"""Deep integration closed in simulation: over samples, over correlators' sums, in a wood, with and without monitor."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from benchmarks.gnss.deep_drive import BEGIN, MOTION, NAVIGATION, DeepDrive, Wood
from gnss.receiver import BitSums, Samples, correlate_bits, measure_sums
from navigation import MeasurementError
from navigation.deep import DeepRules, combined, heard, integrate, judge
from navigation.inertial import IMU_PRESETS, InertialStart, TangentFrame, imu_log, join, navigate, position_fixes
from tests.reference import correlator_sums, gps_signals

HERE = pytest.mark.skipif(
    not (MOTION.exists() and NAVIGATION.exists()), reason="the motion and ephemerides of ../shared are not here"
)


def through(drive, correlate, rules=None, prns=None):
    asked = drive.prns if prns is None else prns
    return integrate(
        correlate, drive.log, drive.start, drive.noise, drive.frame, drive.ephemerides, BEGIN, asked, drive.clock, rules
    )


def errors_m(drive, track):
    return np.linalg.norm(track.position_m - drive.drive.position(track.times_s), axis=1)


def sampled(drive, prns, rate_hz=2.1e6):
    """A correlator over samples of the drive's satellites: signals by the definition, one second at a time."""
    kept = {}

    def correlate(prn, begin_s, times_s, delays_s):
        if begin_s not in kept:
            rng = np.random.default_rng(round(begin_s))
            t = np.arange(round(times_s[-1] * rate_hz)) / rate_hz
            values = gps_signals.noise(rng, len(t))
            for one in prns:
                true_s = np.interp(t, times_s, drive.true_delays_s(one, begin_s, times_s))
                bits = np.random.default_rng(one).choice([-1, 1], 997)
                start_s = BEGIN.second_of_week % 0.02 + begin_s
                values += gps_signals.signal(one, true_s, rate_hz, 38.0, bits, start_s=start_s)
            kept.clear()
            kept[begin_s] = Samples(values, rate_hz)
        return correlate_bits(kept[begin_s], prn, times_s, delays_s, BEGIN.second_of_week % 0.02 + begin_s)

    return correlate


@HERE
def test_over_samples_the_loop_closes():
    drive = DeepDrive(3, 3.1, Wood())
    prns = drive.prns[:5]
    track = through(drive, sampled(drive, prns), prns=prns)
    assert track.detected.tolist() == [5, 5, 5]
    assert track.used.min() >= 4
    assert track.carried[1:].min() >= 4
    first_m = np.linalg.norm(drive.start.position_m - drive.drive.position(0.0))
    off_m = errors_m(drive, track)
    assert off_m[-1] < 3.0 * math.sqrt(np.trace(track.position_covariance_m2[-1]))
    assert off_m[-1] < first_m + 1.0
    # the phases hold its velocity to centimetres a second
    velocity = track.end.velocity_m_per_s - drive.drive.velocity(track.times_s[-1])
    assert np.linalg.norm(velocity) < 0.06


@HERE
def test_a_wood_costs_little_and_what_it_reflects_is_left_out():
    wood = Wood(from_s=20.0, top_m=25.0, factor=1.6, reflected=0.1)
    drive = DeepDrive(1, 45.1, wood)
    judged, believed = (through(drive, drive.correlate, DeepRules(monitored=on)) for on in (True, False))
    late = judged.times_s > 25.0
    within, without = (np.sqrt(np.mean(errors_m(drive, track)[late] ** 2)) for track in (judged, believed))
    # a metre off at first, it has not come to the half metre of a longer drive when the wood begins
    assert within < 1.2 * errors_m(drive, judged)[18]
    assert within < 0.7
    assert without > 2.0 * within
    strengths = [one.cn0_db_hz for second in judged.heard[25:] for one in second if one.detected]
    assert 18.0 < np.median(strengths) < 30.0
    assert len(drive.reflections) > 20
    assert judged.used[late].mean() < judged.detected[late].mean()


@HERE
def test_bits_by_themselves_are_heard_less_often():
    drive = DeepDrive(1, 3.1, Wood(from_s=0.0, top_m=25.0, factor=1.8))
    long, short = (
        np.mean([one.detected / one.sums for second in track.heard for one in second])
        for track in (through(drive, drive.correlate, DeepRules(bits=bits)) for bits in (50, 1))
    )
    assert long > short + 0.3


def test_a_clock_falls_out_and_what_is_left_is_its_least_squares():
    rng = np.random.default_rng(2)
    units = rng.normal(size=(8, 3))
    units /= np.linalg.norm(units, axis=1, keepdims=True)
    sigmas = rng.uniform(0.5, 3.0, 8)
    off = -units @ (1.0, -2.0, 0.5) + 40.0 + rng.normal(0.0, sigmas)
    found = judge(-units, off, sigmas, 100.0 * np.eye(3), monitored=False)
    table = np.column_stack([-units, np.ones(8)]) / sigmas[:, None]
    solution, *_ = np.linalg.lstsq(table, off / sigmas, rcond=None)
    ours, *_ = np.linalg.lstsq(found.rows, found.values, rcond=None)
    assert ours == pytest.approx(solution[:3], abs=1e-9)
    assert found.rows.shape == (7, 3)
    later = judge(-units, off + 1e4, sigmas, 100.0 * np.eye(3), monitored=False)
    assert later.values == pytest.approx(found.values, abs=1e-8)
    assert np.linalg.inv(found.rows.T @ found.rows) == pytest.approx(np.linalg.inv(table.T @ table)[:3, :3])


def test_a_liar_is_left_out_by_parity_and_where_few_are_there_by_foresight():
    rng = np.random.default_rng(4)
    units = rng.normal(size=(8, 3))
    units /= np.linalg.norm(units, axis=1, keepdims=True)
    off = 7.0 + rng.normal(0.0, 1.0, 8)
    off[3] += 40.0
    wide = judge(-units, off, np.ones(8), 1e4 * np.eye(3))
    assert wide.kept.tolist() == [n != 3 for n in range(8)]
    assert wide.clock == pytest.approx(7.0, abs=1.5)
    few = judge(-units[:4], off[:4], np.ones(4), 0.1 * np.eye(3))
    assert few.kept.tolist() == [True, True, True, False]
    none = judge(-units, off, np.full(8, np.inf), np.eye(3))
    assert (none.kept.any(), len(none.values), math.isnan(none.clock)) == (False, 0, True)


def test_two_liars_of_six_are_told_where_foresight_counts_beside_the_others():
    """Six with a clock leave two to spare: which two of them lie, parity alone does not tell (133 of these 200)."""
    rng, right = np.random.default_rng(9), 0
    for _ in range(200):
        units = rng.normal(size=(6, 3))
        units[:, 2] = np.abs(units[:, 2]) + 0.3
        units /= np.linalg.norm(units, axis=1, keepdims=True)
        off = 7.0 - units @ rng.normal(0.0, 0.02, 3) + rng.normal(0.0, 0.005, 6)
        off[:2] += rng.uniform(0.1, 0.3, 2) * rng.choice([-1, 1], 2)
        found = judge(-units, off, np.full(6, 0.005), 0.02**2 * np.eye(3))
        right += found.kept.tolist() == [False, False, True, True, True, True]
    assert right > 0.9 * 200
    # where all agree, and not with what was foretold, it is not they that are left out
    far = judge(-units, -units @ (1.0, -2.0, 0.5), np.full(6, 0.005), 0.02**2 * np.eye(3))
    assert far.kept.all()


@pytest.mark.parametrize("bits", [1, 5, 50])
def test_parts_of_a_second_tell_range_rate_and_phase_together(bits):
    rng, edges = np.random.default_rng(5), np.arange(51) * 0.02
    late_m, rate = 12.0, 0.03
    off_s = (late_m + rate * (edges - 0.5)) / gps_signals.C
    made = correlator_sums.sums(off_s, 40.0, rng.choice([-1, 1], 50), rng=rng)
    sums = BitSums(5, made, edges, np.array([0.0, 1.0]), np.zeros(2))
    found = heard(sums, bits, 2.0, 1e-3)
    assert (found.prn, found.detected, found.sums) == (5, 50 // bits, 50 // bits)
    assert abs(found.range_m - late_m) < 4.0 * found.range_sigma_m < 10.0
    assert abs(found.rate_m_per_s - rate) < 4.0 * found.rate_sigma_m_per_s < (0.25 if bits == 1 else 0.05)
    half_m = 0.5 * gps_signals.C / gps_signals.L1_HZ
    assert abs(math.remainder(found.phase_m - late_m, half_m)) < 4.0 * found.phase_sigma_m + 0.002
    nothing = combined(5, [measure_sums(dataclasses.replace(sums, sums=made * 1e-3))])
    assert (nothing.detected, nothing.range_sigma_m, math.isnan(nothing.cn0_db_hz)) == (0, math.inf, True)


def test_a_log_in_parts_is_the_log_in_one():
    times = np.arange(0.0, 4.01, 0.01)
    forces = np.tile([0.3, -0.1, 9.8], (len(times), 1))
    rates = np.tile([0.0, 0.01, 0.2], (len(times), 1))
    noise, frame = IMU_PRESETS["Leador-A15"], TangentFrame(0.6)
    start = InertialStart((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), lever_arm_sigma_m=0.1)
    fixes = position_fixes([0.5, 1.5, 2.5, 3.5], np.arange(12.0).reshape(4, 3) / 10.0, 0.1)
    whole = navigate(imu_log(times, forces, rates), start, fixes, noise, frame)
    belief = start
    for second in range(4):
        part = slice(100 * second, 100 * second + 101)
        inside = (fixes.times_s > second) & (fixes.times_s < second + 1)
        mine = join(position_fixes([second + 0.5], fixes.values[inside][None], 0.1))
        track = navigate(imu_log(times[part], forces[part], rates[part]), belief, mine, noise, frame)
        belief = track.end()
    # but for coning over one step at each seam
    assert belief.position_m == pytest.approx(whole.position_m[-1], abs=1e-4)
    assert track.covariance == pytest.approx(whole.covariance, rel=1e-4, abs=1e-10)


def test_rules_and_logs_that_are_of_no_use_are_refused():
    for fields in ({"bits": 0}, {"bits": 51}, {"range_floor_m": 0.0}):
        with pytest.raises(MeasurementError, match="1 to 50 bits"):
            DeepRules(**fields)
    log = imu_log(np.arange(0.0, 1.0, 0.01), np.tile([0.0, 0.0, 9.8], (100, 1)), np.zeros((100, 3)))
    start = InertialStart((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    with pytest.raises(MeasurementError, match="a second and 40 ms"):
        integrate(None, log, start, IMU_PRESETS["tactical"], TangentFrame(0.6), None, BEGIN, [1], None)
