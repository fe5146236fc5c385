"""Mechanisation against closed forms: gravity, a drive's own derivatives, standing still, Schuler, coning."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from navigation import StateError
from navigation.inertial import (
    EARTH,
    MARS,
    MOON,
    ImuNoise,
    InertialStart,
    TangentFrame,
    align_moving,
    align_still,
    angles_of,
    imu_log,
    join,
    matrices_of,
    navigate,
    quaternion_of_angles,
)
from tests.reference.inertial import Drive, along, normal_gravity

NOISE = ImuNoise(1e-4, 1e-5, 1e-3, 1e-6)
FRAME = TangentFrame(0.7, 0.2, 300.0)


def dead_reckoned(times_s, forces, rates, start, frame=FRAME):
    log = imu_log(times_s, forces, rates, gravity_m_per_s2=float(np.linalg.norm(frame.gravity_m_per_s2())))
    return navigate(log, start, join(), NOISE, frame)


@pytest.mark.parametrize("latitude", [-1.5, -0.4, 0.0, 0.7, math.pi / 2])
@pytest.mark.parametrize("altitude", [0.0, 2000.0])
def test_gravity_is_that_of_wgs_84_and_points_along_the_normal(latitude, altitude):
    frame = TangentFrame(latitude, 0.0, altitude)
    np.testing.assert_allclose(frame.gravity_m_per_s2(), [0.0, 0.0, -normal_gravity(latitude, altitude)], atol=2e-9)
    away = frame.gravity_m_per_s2((3000.0, 4000.0, -1.0))
    assert np.arctan2(math.hypot(away[0], away[1]), -away[2]) == pytest.approx(5000.0 / 6.37e6, rel=0.01)


def test_moon_and_mars_have_their_own():
    assert TangentFrame(0.3, body=MOON).gravity_m_per_s2()[2] == pytest.approx(-4902.8001e9 / 1737.4e3**2, rel=1e-4)
    polar, equatorial = (-TangentFrame(lat, body=MARS).gravity_m_per_s2()[2] for lat in (math.pi / 2, 0.0))
    gm, a, j2, rate = 4.282837e13, 3_396_190.0, 1.9604e-3, 7.088218e-5
    assert equatorial == pytest.approx(gm / a**2 * (1.0 + 1.5 * j2) - rate**2 * a, rel=1e-4)
    b = a * (1.0 - 1.0 / 169.894447)
    assert polar == pytest.approx(gm / b**2 * (1.0 - 3.0 * j2 * (a / b) ** 2), rel=1e-4)


def test_places_are_those_of_the_ellipsoid():
    frame = TangentFrame(0.7, 0.2, 300.0)
    np.testing.assert_allclose(frame.from_geodetic_m(0.7, 0.2, 350.0), [0.0, 0.0, 50.0], atol=1e-8)
    east = frame.from_geodetic_m(0.7, 0.2001, 300.0)
    normal = 6378137.0 / math.sqrt(1.0 - 0.00669437999014 * math.sin(0.7) ** 2) + 300.0
    assert east[0] == pytest.approx(normal * math.cos(0.7) * math.sin(1e-4), abs=1e-6)


@pytest.mark.parametrize("body", [EARTH, MOON, MARS], ids=lambda body: body.name)
def test_perfect_readings_lead_along_the_drive(body):
    frame = TangentFrame(0.6, 0.0, 100.0, body)
    drive = Drive(4, 120.0)

    def gravity(positions_m):
        return along(frame.gravity_m_per_s2, positions_m)

    sine, cosine = math.sin(0.6), math.cos(0.6)
    forces, rates = drive.readings(gravity, body.rate_rad_per_s * np.array([0.0, cosine, sine]))
    begin = np.roll(drive.attitude(np.zeros(1)).as_quat()[0], 1)
    start = InertialStart(drive.position(0.0), drive.velocity(0.0), begin)
    track = dead_reckoned(drive.times_s, forces, rates, start, frame)
    np.testing.assert_allclose(track.position_m, drive.position(drive.times_s), atol=0.01)
    np.testing.assert_allclose(track.velocity_m_per_s, drive.velocity(drive.times_s), atol=3e-4)
    turn = Rotation.from_matrix(matrices_of(track.quaternion)).inv() * drive.attitude(drive.times_s)
    assert turn.magnitude().max() < 1e-6


def test_who_stands_still_stays_for_an_hour_and_finds_north_by_the_planets_turning():
    times = np.arange(0.0, 3600.0, 0.05)
    heading, pitch, roll = 2.1, 0.05, -0.08
    attitude = quaternion_of_angles(heading, pitch, roll)
    matrix = matrices_of(attitude)
    turning = EARTH.rate_rad_per_s * np.array([0.0, math.cos(0.7), math.sin(0.7)])
    force, rate = matrix.T @ -FRAME.gravity_m_per_s2(), matrix.T @ turning
    start = InertialStart(np.zeros(3), np.zeros(3), attitude)
    track = dead_reckoned(times, np.tile(force, (len(times), 1)), np.tile(rate, (len(times), 1)), start)
    # an error of the height grows by exp(t / 570 s): here 550 times
    np.testing.assert_allclose(track.position_m[-1], 0.0, atol=3e-3)
    np.testing.assert_allclose(angles_of(align_still(force, rate, frame=FRAME)), (heading, pitch, roll), atol=1e-9)
    np.testing.assert_allclose(angles_of(align_still(force, heading_rad=2.1)), (heading, pitch, roll), atol=1e-9)


def test_a_level_error_swings_with_schulers_period():
    times = np.arange(0.0, 5064.0, 0.1)
    frame = TangentFrame(0.0, 0.0, 0.0, EARTH.__class__("still", 6_378_137.0, 0.0, 0.0, 9.8, 9.8))
    tilt = 1e-4
    forces = np.tile([0.0, 0.0, 9.8], (len(times), 1))
    start = InertialStart(np.zeros(3), np.zeros(3), quaternion_of_angles(0.0, tilt, 0.0))
    track = dead_reckoned(times, forces, np.zeros_like(forces), start, frame)
    period = math.sqrt(6_378_137.0 / 9.8)
    # the nose too high: what holds it up seems to push it back
    expected = -tilt * 6_378_137.0 * (1.0 - np.cos(times / period))
    np.testing.assert_allclose(track.position_m[:, 1], expected, atol=0.2)


def test_coning_does_not_drift():
    rate, angle = 2.0 * math.pi * 8.0, math.radians(1.0)
    times = np.arange(0.0, 30.0, 0.005)
    axes = np.stack([np.cos(rate * times), np.sin(rate * times), np.zeros_like(times)], axis=1)
    cone = Rotation.from_rotvec(angle * axes)
    turns = (cone[:-1].inv() * cone[1:]).as_rotvec()
    # what a gyro sums up over a step, Bortz' own term taken out again: the integral of its rate
    summed = np.zeros((len(times) - 1, 3))
    summed[:, 0] = math.sin(angle) * np.diff(np.cos(rate * times))
    summed[:, 1] = math.sin(angle) * np.diff(np.sin(rate * times))
    summed[:, 2] = -rate * (1.0 - math.cos(angle)) * 0.005 * np.ones(len(times) - 1)
    assert np.abs(summed - turns).max() > 3e-7, "the sum of rates is not the turn, or there would be nothing to correct"
    frame = TangentFrame(0.0, 0.0, 0.0, EARTH.__class__("still", 6_378_137.0, 0.0, 0.0, 9.8, 9.8))
    rates = np.concatenate([summed[:1], summed]) / 0.005
    forces = cone.inv().apply([0.0, 0.0, 9.8])
    begin = np.roll(cone[0].as_quat(), 1)
    track = dead_reckoned(times, forces, rates, InertialStart(np.zeros(3), np.zeros(3), begin), frame)
    off = (Rotation.from_matrix(matrices_of(track.quaternion[-1])).inv() * cone[-1]).as_rotvec()
    uncorrected = Rotation.identity()
    for turn in summed:
        uncorrected = uncorrected * Rotation.from_rotvec(turn)
    worse = ((cone[0] * uncorrected).inv() * cone[-1]).magnitude()
    assert np.linalg.norm(off) < 0.05 * worse


def test_angles_are_those_of_turns_about_the_vehicles_axes():
    quaternion = quaternion_of_angles(0.4, 0.2, -0.3)
    turns = Rotation.from_euler("ZYX", [np.pi / 2.0 - 0.4, -0.2, -0.3])
    np.testing.assert_allclose(matrices_of(quaternion), turns.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(angles_of(quaternion), (0.4, 0.2, -0.3), atol=1e-12)
    # right side down: what is to the left of the vehicle lies higher
    assert matrices_of(quaternion_of_angles(0.0, 0.0, 0.1))[2, 1] > 0.0


def test_a_moving_vehicle_is_aligned_by_its_course():
    pushed, velocity = np.array([0.5, -0.3, 0.1]), np.array([6.0, 4.0, 0.0])
    attitude = quaternion_of_angles(math.atan2(6.0, 4.0), 0.0, 0.0)
    force = matrices_of(attitude).T @ (pushed + np.array([0.0, 0.0, 9.8]))
    np.testing.assert_allclose(matrices_of(align_moving(force, velocity, pushed)), matrices_of(attitude), atol=1e-12)
    with pytest.raises(StateError, match="no course"):
        align_moving(force, (0.1, 0.2, 0.0))


def test_attitudes_that_cannot_be_found_are_refused():
    with pytest.raises(StateError, match="no way up"):
        align_still(np.zeros(3), heading_rad=0.0)
    with pytest.raises(StateError, match="needs heading_rad"):
        align_still([0.0, 0.0, 9.8])
    with pytest.raises(StateError, match="do not feel"):
        align_still([0.0, 0.0, 9.8], [0.0, 0.0, 1e-5], frame=FRAME)
    with pytest.raises(StateError, match="quaternion"):
        InertialStart(np.zeros(3), np.zeros(3), np.zeros(4)).belief(NOISE)
