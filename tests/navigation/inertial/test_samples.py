"""Inertial logs as they come: units, axes, times, gaps, saturation; and ten million steps."""

import re

import numpy as np
import pytest

from navigation import MeasurementError, StateError, TimeOrderError
from navigation.inertial import (
    IMU_PRESETS,
    ImuNoise,
    InertialStart,
    TangentFrame,
    from_forward_right_down,
    imu_log,
    join,
    navigate,
    position_fixes,
    ranges_to_anchors,
)
from navigation.inertial.samples import turned

TIMES_S = np.arange(0.0, 5.0, 0.01)
STILL = np.tile([0.0, 0.0, 9.81], (len(TIMES_S), 1))
TURNS = np.zeros_like(STILL)


def changed(array, row, values):
    copy = np.array(array)
    copy[row] = values
    return copy


def test_readings_in_g_and_degrees_are_turned_into_si_when_that_is_said():
    log = imu_log(TIMES_S, STILL / 9.80665, TURNS + 90.0, force_unit="g", rate_unit="deg/s")
    np.testing.assert_allclose(log.forces_m_per_s2, STILL)
    np.testing.assert_allclose(log.rates_rad_per_s, np.pi / 2)


def test_axes_that_point_down_are_turned_when_that_is_said():
    log = imu_log(TIMES_S, from_forward_right_down(STILL), TURNS, axes="frd")
    np.testing.assert_allclose(log.forces_m_per_s2, STILL)


@pytest.mark.parametrize(
    ("forces", "rates", "sentence"),
    [
        (STILL / 9.81, TURNS, "in g, it seems"),
        (STILL * 9.81, TURNS, "no driving"),
        (STILL, TURNS + 40.0, "in degrees, it seems"),
        (-STILL, TURNS, "z axis points down, where axes='flu' has it up .* axes='frd' would fit"),
        (np.roll(STILL, 1, axis=1), TURNS, "x axis points up, where axes='flu' has it forward .* axes='ufl' would fit"),
        (changed(STILL, 7, np.nan), TURNS, "Reading 7 of the inertial log is not finite"),
    ],
)
def test_readings_that_cannot_be_so_are_refused_with_what_they_seem(forces, rates, sentence):
    with pytest.raises(MeasurementError, match=sentence):
        imu_log(TIMES_S, forces, rates)


@pytest.mark.parametrize("said", ["flu", "frd", "ufl", "rfu"])
@pytest.mark.parametrize("true", ["flu", "frd", "ufl", "dfr", "fur", "fdl"])
def test_axes_that_gravity_contradicts_are_refused_with_axes_that_it_does_not(true, said):
    # what such a unit reads: the matrix of true axes is orthogonal
    read = STILL @ turned(np.eye(3), true).T
    try:
        imu_log(TIMES_S, read, TURNS, axes=said)
    except MeasurementError as error:
        named = re.search("axes='([a-z]{3})' would fit", str(error))[1]
        assert named != said
        imu_log(TIMES_S, read, TURNS, axes=named)
    else:
        upright = max(true.find("u"), true.find("d"))
        assert said[upright] == true[upright]


def test_times_that_go_backwards_are_refused_and_repeated_ones_dropped_and_told():
    with pytest.raises(TimeOrderError, match="goes backwards") as caught:
        imu_log(changed(TIMES_S, 100, 0.2), STILL, TURNS)
    assert caught.value.index == 100
    log = imu_log(changed(TIMES_S, 100, TIMES_S[99]), STILL, TURNS)
    assert len(log.times_s) == len(TIMES_S) - 1
    assert any("repeat a time" in sentence for sentence in log.warnings)


def test_gaps_and_saturated_axes_widen_what_is_believed_and_are_told():
    kept = np.r_[:200, 350:500]
    stuck = changed(STILL, slice(150, 160), (0.0, 0.0, 18.0 * 9.80665))
    noise = IMU_PRESETS["ADIS16405"]
    log = imu_log(TIMES_S[kept], stuck[kept], TURNS[kept], noise=noise)
    assert np.count_nonzero(log.gaps) == 11
    assert any("Gaps of more than 0.1 s: 1, " in sentence for sentence in log.warnings)
    assert any("Saturated readings: 10;" in sentence for sentence in log.warnings)
    start = InertialStart(np.zeros(3), np.zeros(3), (1.0, 0.0, 0.0, 0.0))
    track = navigate(log, start, join(), noise, TangentFrame(0.5))
    assert track.sigmas[200, 3] > 2.0 * track.sigmas[199, 3]


def test_what_is_no_beginning_or_no_measurement_is_refused():
    log, frame, noise = imu_log(TIMES_S, STILL, TURNS), TangentFrame(0.5), IMU_PRESETS["tactical"]
    start = InertialStart(np.zeros(3), np.zeros(3), (1.0, 0.0, 0.0, 0.0))
    with pytest.raises(TimeOrderError, match="lie outside"):
        navigate(log, start, position_fixes([7.0], np.zeros((1, 3)), 1.0), noise, frame)
    with pytest.raises(StateError, match="position_sigma_m"):
        navigate(log, InertialStart(np.zeros(3), np.zeros(3), (1.0, 0.0, 0.0, 0.0), -1.0), join(), noise, frame)
    with pytest.raises(MeasurementError, match="sight"):
        ranges_to_anchors([1.0], [[0.0, 0.0, 9.0]], [9.0], 0.1, sight=1.5)
    with pytest.raises(MeasurementError, match="above zero"):
        position_fixes([1.0], np.zeros((1, 3)), 0.0)
    with pytest.raises(MeasurementError, match="angle_walk_rad_per_sqrt_s"):
        ImuNoise(1.0, 0.0, 1.0, 1.0)


def test_a_log_in_pieces_is_the_log():
    rng, frame, noise = np.random.default_rng(5), TangentFrame(0.5), IMU_PRESETS["Leador-A15"]
    times = np.arange(2001) * 0.02
    forces = np.tile([0.02, -0.01, 9.81], (len(times), 1)) + rng.normal(0.0, 0.01, (len(times), 3))
    rates = rng.normal(0.0, 1e-4, (len(times), 3))
    fixes_s = np.arange(0.5, 39.0)
    places = rng.normal(0.0, 1.0, (len(fixes_s), 3))
    start = InertialStart(np.zeros(3), np.zeros(3), (1.0, 0.0, 0.0, 0.0), lever_arm_sigma_m=0.1)
    whole = navigate(imu_log(times, forces, rates), start, position_fixes(fixes_s, places, 1.0), noise, frame)
    for piece in (slice(0, 1001), slice(1000, None)):
        log = imu_log(times[piece], forces[piece], rates[piece])
        mine = (fixes_s > log.times_s[0]) & (fixes_s <= log.times_s[-1])
        track = navigate(log, start, position_fixes(fixes_s[mine], places[mine], 1.0), noise, frame)
        start = track.end()
    assert len(track.covariance) == 24
    # the one difference: coning between the last reading of a piece and the first of the next
    np.testing.assert_allclose(track.position_m[-1], whole.position_m[-1], atol=1e-3)
    np.testing.assert_allclose(track.sigmas[-1], whole.sigmas[-1], rtol=1e-4)


def test_a_covariance_that_is_none_is_refused():
    start = InertialStart(np.zeros(3), np.zeros(3), (1.0, 0.0, 0.0, 0.0), covariance=-np.eye(15))
    log = imu_log(np.arange(10.0), np.tile([0.0, 0.0, 9.8], (10, 1)), np.zeros((10, 3)))
    with pytest.raises(StateError, match="is not positive"):
        navigate(log, start, join(), IMU_PRESETS["tactical"], TangentFrame(0.5))


def test_a_million_steps_without_any_help_stay_finite():
    times = np.arange(1_000_000) * 0.05
    forces = np.tile([0.02, -0.01, 9.81], (len(times), 1))
    rates = np.tile([1e-4, 0.0, 2e-4], (len(times), 1))
    start = InertialStart(np.zeros(3), np.zeros(3), (1.0, 0.0, 0.0, 0.0))
    track = navigate(imu_log(times, forces, rates), start, join(), IMU_PRESETS["lower"], TangentFrame(0.5))
    assert np.isfinite(track.position_m).all()
    assert np.isfinite(track.sigmas).all()
