"""Drives from their logs: where they begin, which heading the log fits, what is passed over, what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest

from navigation import MeasurementError, StateError
from navigation.drives import (
    SOURCES,
    DriveLog,
    DriveSettings,
    Fixes,
    Foreseen,
    Ranges,
    Readings,
    Speeds,
    navigate_drive,
)
from navigation.drives.logs import drive_measurements, imu_of
from navigation.inertial import IMU_PRESETS, TangentFrame, vehicle_speeds
from tests.reference.inertial import Drive, along

FRAME = TangentFrame(0.6, 0.0, 100.0)
RATE = FRAME.body.rate_rad_per_s * np.array([0.0, math.cos(0.6), math.sin(0.6)])
ANCHORS_M = np.array([(800.0, 300.0, 250.0), (-600.0, 500.0, 300.0), (100.0, -900.0, 200.0), (-300.0, -400.0, 500.0)])
SETTINGS = DriveSettings(imu=IMU_PRESETS["ADIS16405"], range_sigma_m=0.3, fix_sigma_m=(1.0, 1.0, 1.5))


@pytest.fixture(scope="module")
def drive():
    """(the truth, readings of it, its ranges in turn, its fixes with velocities)."""
    rng, made = np.random.default_rng(4), Drive(5, 60.0)
    forces, rates = made.readings(lambda places_m: along(FRAME.gravity_m_per_s2, places_m), RATE)
    forces = forces + rng.normal(0.0, 0.02, forces.shape) + rng.normal(0.0, 0.05, 3)
    rates = rates + rng.normal(0.0, 0.002, rates.shape) + rng.normal(0.0, 0.01, 3)
    at_s = np.arange(0.1, 60.0, 0.1)
    anchor = np.arange(len(at_s)) % len(ANCHORS_M)
    measured = np.linalg.norm(made.position(at_s) - ANCHORS_M[anchor], axis=1) + rng.normal(0.0, 0.3, len(at_s))
    fixes_s = np.arange(0.0, 60.0)
    places = made.position(fixes_s) + rng.normal(0.0, 1.0, (60, 3))
    nothing = np.full((60, 3), np.nan)
    velocities = made.velocity(fixes_s) + rng.normal(0.0, 0.1, (60, 3))
    return (
        made,
        Readings(made.times_s, forces, rates),
        Ranges(at_s, anchor, measured, np.full(len(at_s), np.nan)),
        Fixes(fixes_s, places, nothing, velocities, nothing),
    )


def off_m(made, track, from_s=20.0):
    """(rms distance from the truth, share of places within the bubble)."""
    late = track.times_s > from_s
    away = np.linalg.norm(track.position_m[late] - made.position(track.times_s[late]), axis=1)
    return float(np.sqrt((away**2).mean())), float((away <= track.radius_m[late]).mean())


def test_fixes_tell_where_a_drive_begins_and_their_course_its_heading(drive):
    made, readings, _, fixes = drive
    track = navigate_drive(DriveLog(readings, fixes), SETTINGS, FRAME)
    rms_m, held = off_m(made, track)
    assert rms_m < 1.0
    assert held > 0.95
    assert "The heading at the beginning is the course of the fixes." in track.told
    assert track.used(SOURCES.index("position")) == (180, 180)


def test_radios_on_arms_of_their_own_are_ranged_each_from_where_it_is(drive):
    made, readings, plain, _ = drive
    rng, arms = np.random.default_rng(8), np.array([(2.0, 1.5, 0.0), (-1.0, -1.5, 0.5)])
    offsets = arms[np.arange(len(plain.times_s)) // len(ANCHORS_M) % 2]
    radios = made.position(plain.times_s) + made.attitude(plain.times_s).apply(offsets)
    measured = np.linalg.norm(radios - ANCHORS_M[plain.anchor], axis=1) + rng.normal(0.0, 0.3, len(radios))
    told = replace(plain, measured_m=measured, offsets_m=offsets)
    settings = replace(SETTINGS, position_m=tuple(made.position(0.0)), position_sigma_m=2.0)
    errors = [
        off_m(made, navigate_drive(DriveLog(readings, ranges=one, anchors_m=ANCHORS_M), settings, FRAME))[0]
        for one in (told, replace(told, offsets_m=(0.0, 0.0, 0.0)))
    ]
    assert errors[0] < 0.3
    assert errors[1] > 2.0 * errors[0]


def test_a_range_that_may_be_hidden_is_less_sure_by_the_excess_that_it_may_have(drive):
    _, readings, ranges, _ = drive
    log = DriveLog(readings, ranges=replace(ranges, sigmas_m=np.full(len(ranges.times_s), 0.3)), anchors_m=ANCHORS_M)
    sight = np.where(np.arange(len(ranges.times_s)) % 2, 0.6, 0.4)
    imu = imu_of(log, SETTINGS, 9.8)
    for excess_m, variance_m2 in ((5.0, 0.09 + 0.4 * 2.0 * 25.0), (0.0, 0.09 / 0.6)):
        settings = replace(SETTINGS, hidden_excess_m=excess_m)
        told, _ = drive_measurements(log, imu, settings, Foreseen(sight=sight))
        mine = told.source == SOURCES.index("range")
        np.testing.assert_allclose(told.variances[mine][1::2], variance_m2)
        assert np.isinf(told.variances[mine][::2]).all()
    with pytest.raises(MeasurementError, match="hidden_excess_m"):
        replace(SETTINGS, hidden_excess_m=-1.0)


def test_a_straight_and_even_drive_has_the_course_of_its_fixes_though_its_readings_are_still():
    times_s = np.arange(0.0, 30.0, 0.05)
    forces = np.tile(FRAME.gravity_m_per_s2(np.zeros(3)) * -1.0, (len(times_s), 1))
    fixes_s = np.arange(0.0, 30.0)
    west = np.tile([-2.0, 0.0, 0.0], (30, 1))
    nothing = np.full((30, 3), np.nan)
    fixes = Fixes(fixes_s, west * fixes_s[:, None], nothing, west, nothing)
    track = navigate_drive(
        DriveLog(Readings(times_s, forces, np.tile(RATE, (len(times_s), 1))), fixes), SETTINGS, FRAME
    )
    assert "The heading at the beginning is the course of the fixes." in track.told
    assert np.degrees(track.angles_rad[-1, 0] % (2.0 * np.pi)) == pytest.approx(270.0, abs=10.0)


def test_ranges_alone_tell_place_and_heading(drive):
    made, readings, ranges, _ = drive
    settings = replace(SETTINGS, velocity_sigma_m_per_s=10.0)
    track = navigate_drive(DriveLog(readings, ranges=ranges, anchors_m=ANCHORS_M), settings, FRAME)
    rms_m, held = off_m(made, track)
    assert rms_m < 0.5
    assert held > 0.95
    assert any(told.startswith("Nothing told the heading") for told in track.told)
    heading = made.angles(track.times_s)[:, 0]
    turned = (track.angles_rad[:, 0] - heading + math.pi) % (2.0 * math.pi) - math.pi
    # a unit of 3 °/s at turn-on, on a drive that hardly turns
    assert np.degrees(np.abs(turned[track.times_s > 20.0])).max() < 12.0


def test_a_smoothed_drive_is_nearer_to_the_truth_than_a_filtered_one(drive):
    made, readings, _, fixes = drive
    filtered, smoothed = (
        navigate_drive(DriveLog(readings, fixes), replace(SETTINGS, smoother=back), FRAME) for back in (False, True)
    )
    assert (filtered.smoothed, smoothed.smoothed) == (False, True)
    assert off_m(made, smoothed, 0.0)[0] < 0.8 * off_m(made, filtered, 0.0)[0]


@pytest.mark.parametrize(("axes", "order", "signs"), [("rfu", (1, 0, 2), (-1, 1, 1)), ("frd", (0, 1, 2), (1, -1, -1))])
def test_readings_along_other_axes_make_the_same_drive(drive, axes, order, signs):
    _, readings, _, fixes = drive
    # x of the unit points right, which is minus left
    turned = Readings(readings.times_s, readings.forces[:, order] * signs, readings.rates[:, order] * signs)
    plain = navigate_drive(DriveLog(readings, fixes), SETTINGS, FRAME)
    other = navigate_drive(DriveLog(turned, fixes), replace(SETTINGS, axes=axes), FRAME)
    np.testing.assert_allclose(other.position_m, plain.position_m, atol=1e-9)


def test_ranges_that_the_map_hides_do_not_count(drive):
    made, readings, ranges, fixes = drive
    lying = replace(ranges, measured_m=ranges.measured_m + np.where(ranges.anchor == 2, 3.0, 0.0))
    log = DriveLog(readings, fixes, lying, anchors_m=ANCHORS_M)
    wide = replace(SETTINGS, gate_sigma=math.inf)
    believed = navigate_drive(log, wide, FRAME)
    hidden = navigate_drive(log, wide, FRAME, Foreseen(np.where(ranges.anchor == 2, 0.01, np.nan)))
    assert hidden.used(0)[0] == np.count_nonzero(ranges.anchor != 2)
    assert off_m(made, hidden)[0] < 0.5 * off_m(made, believed)[0]


def test_an_odometer_and_no_sliding_carry_a_drive_through_an_outage(drive):
    made, readings, _, fixes = drive
    early = fixes.times_s < 25.0
    short = Fixes(*(getattr(fixes, name)[early] for name in Fixes.__dataclass_fields__))
    speeds = Speeds(made.times_s[::20], np.linalg.norm(made.velocity(made.times_s[::20]), axis=1))
    settings = replace(SETTINGS, smoother=False, sideways_sigma_m_per_s=0.05)
    bare = navigate_drive(DriveLog(readings, short), replace(SETTINGS, smoother=False), FRAME)
    aided = navigate_drive(DriveLog(readings, short, speeds=speeds), settings, FRAME)
    assert off_m(made, aided, 50.0)[0] < 0.3 * off_m(made, bare, 50.0)[0]


def test_a_unit_ahead_of_the_wheels_swings_sideways_in_a_turn():
    # 0.8 m ahead of the pivot, half a radian a second to the left: 0.4 m/s to the left
    speeds = vehicle_speeds(
        [1.0], [2.0], 0.1, sideways_sigma_m_per_s=0.1, pivot_m=(-0.8, 0.0, 0.0), rates_rad_per_s=(0.0, 0.0, 0.5)
    )
    np.testing.assert_allclose(speeds.values, [2.0, 0.4, 0.0], atol=1e-12)


def test_measurements_outside_of_the_readings_are_told_and_not_used(drive):
    _, readings, _, fixes = drive
    late = replace(fixes, times_s=fixes.times_s + 30.0)
    track = navigate_drive(DriveLog(readings, late), SETTINGS, FRAME)
    assert "Not used, for they lie outside of the inertial readings: 29 (position)." in track.told
    assert "The first fix comes 30.0 s after the first reading." in track.told


def test_what_makes_no_drive_is_refused(drive):
    _, readings, ranges, fixes = drive
    with pytest.raises(MeasurementError, match="Nothing in the log corrects"):
        navigate_drive(DriveLog(readings), SETTINGS, FRAME)
    with pytest.raises(StateError, match="came from 1 anchors; 3 are needed"):
        navigate_drive(
            DriveLog(readings, ranges=replace(ranges, anchor=np.zeros_like(ranges.anchor)), anchors_m=ANCHORS_M),
            SETTINGS,
            FRAME,
        )
    with pytest.raises(MeasurementError, match="Ranges go to anchors 0 to 0"):
        navigate_drive(DriveLog(readings, fixes, ranges, anchors_m=ANCHORS_M[:1]), SETTINGS, FRAME)
    with pytest.raises(MeasurementError, match="right-handed"):
        navigate_drive(DriveLog(readings, fixes), replace(SETTINGS, axes="flr"), FRAME)
    with pytest.raises(MeasurementError, match="gate_sigma must be above zero"):
        replace(SETTINGS, gate_sigma=0.0)
