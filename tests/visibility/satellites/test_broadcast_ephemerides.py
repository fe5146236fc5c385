"""Broadcast ephemerides against precise orbits of the same day, and navigation files that are damaged."""

import dataclasses
from datetime import UTC, datetime

import numpy as np
import pytest

from gnss import (
    Ephemerides,
    GpsTime,
    almanac_positions_ecef_m,
    ephemeris_positions_ecef_m,
    instants,
    parse_rinex_navigation,
    read_rinex_navigation,
)
from gnss.errors import AlmanacError, AlmanacFileError
from tests.visibility.satellites.constellation import satellite, shared_file
from tests.visibility.satellites.navigation_texts import as_rinex_3, head
from visibility.satellites import satellite_positions_ecef_m

BROADCAST_MEDIAN_M = 2.0
BROADCAST_WORST_M = 10.0
ALMANAC_GRADE_M = 1200.0


@pytest.fixture(scope="module")
def navigation_text():
    return shared_file("rtklib_brdc0910.09n").read_text()


@pytest.fixture(scope="module")
def ephemerides(navigation_text):
    return parse_rinex_navigation(navigation_text, "brdc0910.09n")


@pytest.fixture(scope="module")
def precise():
    """Times of 1 April 2009 in steps of 15 minutes, and ECEF positions by satellite, (n_times, 3), of the SP3 file."""
    times, positions_m = [], {}
    for line in shared_file("rtklib_esa15253.sp3").read_text().splitlines():
        if line.startswith("* "):
            year, month, day, hour, minute = (int(word) for word in line.split()[1:6])
            times.append(GpsTime.of_utc(datetime(year, month, day, hour, minute, tzinfo=UTC), leap_seconds=0))
        elif line.startswith("PG"):
            km = [float(line[4 + 14 * axis : 18 + 14 * axis]) for axis in range(3)]
            positions_m.setdefault(line[1:4], []).append(1000.0 * np.array(km))
    return times, {name: np.array(rows) for name, rows in positions_m.items()}


def test_broadcast_orbits_agree_with_precise_ones_of_the_same_day(ephemerides, precise):
    times, truth_m = precise
    ids, position_ecef_m = satellite_positions_ecef_m(ephemerides, instants(times))
    assert len(ids) == 30
    assert len(times) == 96
    away_m = np.linalg.norm(position_ecef_m - np.array([truth_m[name] for name in ids]), axis=-1)
    assert np.isfinite(away_m).all()
    assert np.median(away_m) <= BROADCAST_MEDIAN_M
    assert away_m.max() <= BROADCAST_WORST_M


def test_an_ephemeris_without_its_disturbances_is_of_almanac_grade(ephemerides, precise):
    times, truth_m = precise
    near_noon = next(one for one in ephemerides.sets if one.id == "G13" and one.toe == GpsTime(1525, 302_400.0))
    entry = satellite(
        13,
        applicable=near_noon.toe,
        **{
            name: getattr(near_noon, name)
            for name in (
                "eccentricity",
                "inclination_rad",
                "node_rate_rad_per_s",
                "sqrt_semi_major_axis_sqrt_m",
                "node_longitude_rad",
                "argument_of_perigee_rad",
                "mean_anomaly_rad",
            )
        },
    )
    within_2_h = slice(40, 57)
    position_ecef_m = almanac_positions_ecef_m([entry], instants(times[within_2_h]))[0]
    away_m = np.linalg.norm(position_ecef_m - truth_m["G13"][within_2_h], axis=1)
    assert BROADCAST_WORST_M < away_m.max() <= ALMANAC_GRADE_M


def test_the_set_nearest_in_time_is_the_one_that_counts(ephemerides):
    """Where one set gives way to the next they differ by metres, not by kilometres."""
    times = [GpsTime(1525, 259_200.0 + 60.0 * minute) for minute in range(0, 1440, 1)]
    track_m = ephemeris_positions_ecef_m(ephemerides, ["G13"], instants(times))[0]
    third_difference_m = np.linalg.norm(np.diff(track_m, 3, axis=0), axis=1)
    assert third_difference_m.max() < np.median(third_difference_m) + 20.0


def test_unhealthy_satellites_are_left_out_and_listed(ephemerides):
    assert ephemerides.unhealthy_ids == ("G01", "G05")
    assert not set(ephemerides.healthy_ids) & {"G01", "G05"}
    sick = Ephemerides(tuple(one for one in ephemerides.sets if one.health), "sick.09n")
    with pytest.raises(AlmanacError, match=r"All satellites of the navigation file sick\.09n are marked unhealthy"):
        satellite_positions_ecef_m(sick, instants(GpsTime(1525, 302_400.0)))


def test_a_satellite_that_falls_ill_is_unknown_from_then_on(ephemerides):
    well, ill = (next(one for one in ephemerides.sets if one.id == "G13" and one.toe.second_of_week == s)
                 for s in (266_400.0, 280_800.0))  # fmt: skip
    falling_ill = Ephemerides((well, dataclasses.replace(ill, health=63)))
    times = instants([GpsTime(1525, 266_400.0), GpsTime(1525, 280_800.0)])
    known = np.isfinite(ephemeris_positions_ecef_m(falling_ill, ["G13"], times)[0, :, 0])
    np.testing.assert_array_equal(known, [True, False])


def test_times_beyond_two_hours_of_every_set_are_refused(ephemerides):
    with pytest.raises(AlmanacError, match=r"No ephemeris of brdc0910\.09n is within 2 h .* nearest is 24\.0 h away"):
        satellite_positions_ecef_m(ephemerides, instants(GpsTime(1525, 259_200.0 - 86_400.0)))
    one_day = 86_400.0
    _, position_ecef_m = satellite_positions_ecef_m(ephemerides, instants(GpsTime(1525, 172_800.0)), one_day)
    assert np.isfinite(position_ecef_m).any()


def test_both_versions_of_rinex_say_the_same(navigation_text):
    old = parse_rinex_navigation(head(navigation_text, 40))
    new = parse_rinex_navigation(as_rinex_3(head(navigation_text, 40)))
    assert new.sets == old.sets
    assert new.warnings == ("1 records of system R were passed over; only GPS is read.",)


def test_a_field_lands_where_it_belongs(ephemerides):
    first = ephemerides.sets[0]
    assert (first.id, first.toe, first.health) == ("G02", GpsTime(1525, 259_200.0), 0)
    assert first.radius_sin_m == 29.59375
    assert first.mean_motion_difference_rad_per_s == 0.475376937814e-8
    assert first.latitude_cos_rad == 0.150687992573e-5
    assert first.latitude_sin_rad == 0.103265047073e-4
    assert first.inclination_cos_rad == -0.156462192535e-6
    assert first.inclination_sin_rad == -0.726431608200e-7
    assert first.radius_cos_m == 173.34375
    assert first.inclination_rate_rad_per_s == -0.132148361698e-9


def test_a_navigation_file_cut_anywhere_in_a_record_is_refused(navigation_text):
    lines = head(navigation_text, 2).splitlines()
    for kept in [*range(8), *range(9, 16), *range(17, 24)]:
        with pytest.raises(AlmanacFileError, match=r"cut\.09n"):
            parse_rinex_navigation("\n".join(lines[:kept]), "cut.09n")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("RINEX VERSION", "SINEX VERSION", "no RINEX navigation file"),
        ("     2              NAV", "     5              NAV", "RINEX 5; versions 2 to 4 are read"),
        ("     2              NAV", "     4              NAV", "line 9 begins no record"),
        (
            "     2              NAV",
            "     2              GLO",
            "a RINEX file of GLONASS, no RINEX",
        ),
        ("END OF HEADER", "END", "no END OF HEADER"),
        ("0.904141401406E-02", "  who knows       ", r"line 9 \(G02\): eccentricity must be a number"),
        ("0.904141401406E-02", " " * 18, r"\(G02\) lacks its eccentricity"),
        ("0.904141401406E-02", "0.904141401406E+02", "eccentricity must satisfy"),
        ("0.515363668251E+04", "            10.000", "semi-major axis must lie in"),
        ("0.515363668251E+04", "             0.000", "no GPS ephemeris .* marked healthy but has no orbit"),
        ("0.295937500000E+02", "0.295937500000E+99", "radius_sin_m must be a finite number below"),
        (" 2 09  4  1  0  0  0.0", " 2 1e30 4  1 0  0  0.0", "is no date"),
        ("0.259200000000E+06-0.156", "0.959200000000E+06-0.156", "second of the week"),
        (" 2 09  4  1  0", " 2 09 14  1  0", "is no date"),
        (" 2 09  4  1  0  0  0.0", " 2 09  4  1  0  0     ", "epoch must be year, month"),
        (" 2 09  4  1", "99 09  4  1", "no GPS ephemeris .* 1 records of satellites with number 99 were passed over"),
        (" 2 09  4  1", "xx 09  4  1", "satellite number must be a number"),
    ],
)
def test_each_fault_of_a_navigation_file_gets_its_sentence(navigation_text, old, new, words):
    text = head(navigation_text, 1)
    assert old in text
    with pytest.raises(AlmanacFileError, match=words):
        parse_rinex_navigation(text.replace(old, new, 1), "faulty.09n")


def test_a_file_without_gps_is_refused(navigation_text):
    lines = as_rinex_3(head(navigation_text, 1)).splitlines()
    with pytest.raises(AlmanacFileError, match="no GPS ephemeris"):
        parse_rinex_navigation("\n".join(lines[:2] + lines[10:]))
    with pytest.raises(AlmanacFileError, match="begins no record: 'X04"):
        parse_rinex_navigation("\n".join(lines[:2] + ["X" + line[1:] for line in lines[10:]]))
    with pytest.raises(AlmanacError, match="no GPS ephemeris"):
        Ephemerides(())
    with pytest.raises(AlmanacFileError, match="There is no RINEX navigation file"):
        read_rinex_navigation("absent.09n")


def test_a_week_modulo_1024_is_the_one_of_the_records_epoch(navigation_text):
    text = head(navigation_text, 1).replace("0.152500000000E+04", "0.501000000000E+03")
    assert parse_rinex_navigation(text).sets[0].toe.week == 1525
