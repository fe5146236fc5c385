"""Drives by satellites: where they begin, how codes and phases carry them, what is left out and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest

from navigation import StateError
from navigation.drives import SOURCES, DriveLog, DriveSettings, Fixes, Foreseen, Readings, Satellites, navigate_drive
from navigation.inertial import IMU_PRESETS, TangentFrame
from tests.navigation.inertial.test_phase_changes import SATELLITES, sky
from tests.reference.inertial import Drive, along

FRAME = TangentFrame(0.6, 0.0, 100.0)
RATE = FRAME.body.rate_rad_per_s * np.array([0.0, math.cos(0.6), math.sin(0.6)])
SETTINGS = DriveSettings(imu=IMU_PRESETS["ADIS16405"], smoother=False)


@pytest.fixture(scope="module")
def drive():
    """(the truth, readings of it, what a receiver heard twice a second)."""
    rng, made = np.random.default_rng(7), Drive(8, 60.0)
    forces, rates = made.readings(lambda places_m: along(FRAME.gravity_m_per_s2, places_m), RATE)
    forces = forces + rng.normal(0.0, 0.02, forces.shape) + rng.normal(0.0, 0.05, 3)
    rates = rates + rng.normal(0.0, 0.002, rates.shape) + rng.normal(0.0, 0.01, 3)
    at_s = np.repeat(np.arange(0.2, 59.5, 0.5), SATELLITES)
    places, number = sky(at_s)
    length = np.linalg.norm(places - made.position(at_s), axis=1) + 2000.0 + 80.0 * at_s
    weaker = np.linalg.norm(places, axis=1) / places[:, 2]
    codes = length + rng.normal(0.0, 3.0, len(at_s)) * weaker
    phases = length + rng.normal(0.0, 0.003, len(at_s)) * weaker + 0.19 * rng.integers(-9, 9, SATELLITES)[number]
    heard = Satellites(at_s, number, places, codes, phases, np.zeros(len(at_s), np.int64), made.position(0.0) + 40.0)
    return made, Readings(made.times_s, forces, rates), heard


def errors_m(made, track, from_s=20.0):
    late = track.times_s > from_s
    return track.position_m[late] - made.position(track.times_s[late])


def test_satellites_alone_tell_place_velocity_heading_and_clock(drive):
    made, readings, heard = drive
    track = navigate_drive(DriveLog(readings, satellites=heard), SETTINGS, FRAME)
    assert any("course" in told for told in track.told)
    assert np.sqrt((errors_m(made, track) ** 2).sum(axis=1).mean()) < 3.0
    off = np.linalg.norm(errors_m(made, track), axis=1)
    assert np.mean(off <= track.radius_m[track.times_s > 20.0]) > 0.95
    assert abs(track.filtered.clock_m[-1, 0] - 2000.0 - 80.0 * track.times_s[-1]) < 10.0
    used, there = track.used(SOURCES.index("pseudorange"))
    assert used == there == len(heard.times_s)
    used, there = track.used(SOURCES.index("phase"))
    assert there - used == SATELLITES  # the first have nothing before them


@pytest.mark.parametrize("smoother", [False, True])
def test_phases_make_a_track_even(drive, smoother):
    made, readings, heard = drive
    spread = []
    for sigma in (0.01, 0.0):
        settings = replace(
            SETTINGS, phase_sigma_m=sigma, smoother=smoother, heading_rad=float(made.angles(0.0)[..., 0])
        )
        track = navigate_drive(DriveLog(readings, satellites=heard), settings, FRAME)
        left = errors_m(made, track)
        spread.append(np.linalg.norm((left - left.mean(axis=0)).std(axis=0)))
    assert spread[0] < 0.7 * spread[1]


def test_what_the_map_hides_and_what_stands_low_is_left_out(drive):
    made, readings, heard = drive
    wrong = replace(heard, codes_m=heard.codes_m + np.where(heard.satellite == 4, 0.5 * heard.times_s, 0.0))
    sky_of_map = np.where(wrong.satellite == 4, 0.0, np.nan)
    log = DriveLog(readings, satellites=wrong)
    blind, told = (navigate_drive(log, SETTINGS, FRAME, Foreseen(sky=one)) for one in (None, sky_of_map))
    rms = [np.sqrt((errors_m(made, track) ** 2).sum(axis=1).mean()) for track in (blind, told)]
    assert rms[1] < 3.0 < rms[0]
    high = replace(SETTINGS, least_elevation_rad=math.radians(30.0))
    _, there = navigate_drive(log, high, FRAME).used(SOURCES.index("pseudorange"))
    assert there == np.count_nonzero(
        np.radians(20.0 + 7.0 * wrong.satellite) + 1e-4 * wrong.times_s > math.radians(30.0)
    )


def test_faster_phases_than_readings_are_thinned_for_the_smoother(drive):
    made, readings, heard = drive
    every = slice(None, None, 200)
    slow = Readings(*(np.asarray(getattr(readings, name))[every] for name in ("times_s", "forces", "rates")))
    settings = replace(SETTINGS, smoother=True, heading_rad=float(made.angles(0.0)[..., 0]))
    track = navigate_drive(DriveLog(slow, satellites=heard), settings, FRAME)
    _, there = track.used(SOURCES.index("phase"))
    assert there <= SATELLITES * len(slow.times_s)


def test_too_few_codes_tell_no_beginning_and_fixes_go_first(drive):
    made, readings, heard = drive
    few = np.isin(heard.satellite, (0, 1, 2))
    columns = ("times_s", "satellite", "positions_m", "codes_m", "phases_m", "arcs")
    three = Satellites(*(np.asarray(getattr(heard, one))[few] for one in columns), heard.place_m)
    with pytest.raises(StateError, match="satellites nor ranges tell where the drive begins"):
        navigate_drive(DriveLog(readings, satellites=three), SETTINGS, FRAME)
    nothing = np.full((1, 3), np.nan)
    fix = Fixes(np.zeros(1), made.position(np.zeros(1)), np.full((1, 3), 0.5), nothing, nothing)
    track = navigate_drive(DriveLog(readings, fix, satellites=heard), SETTINGS, FRAME)
    np.testing.assert_allclose(track.start.position_m, made.position(0.0))
    settings = replace(SETTINGS, heading_rad=float(made.angles(0.0)[..., 0]))
    track = navigate_drive(DriveLog(readings, fix, satellites=three), settings, FRAME)
    assert track.used(SOURCES.index("pseudorange"))[0] > 0.9 * few.sum()
