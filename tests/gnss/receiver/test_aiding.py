"""Delays foretold from ephemerides: by the definition in inertial axes, and over a week's end."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from gnss import (
    BroadcastEphemeris,
    Ephemerides,
    GnssInputError,
    GpsTime,
    Place,
    ephemeris_clocks_s,
    ephemeris_positions_ecef_m,
    place_ecef_m,
    read_rinex_navigation,
)
from gnss.gps_time import instants
from gnss.receiver import foretold_delays_s
from tests.house.repository import ROOT

AIR_M = 5.0  # of range, by which air that is left out may differ from satellite to satellite
TURN_RAD_PER_S, C = 7.2921151467e-5, 299_792_458.0
TOE = GpsTime(2000, 604_000.0)
ORBIT = BroadcastEphemeris(
    7, TOE, 5153.7, 0.01, 0.5, 4.5e-9, 1.0, -2.0, -8e-9, 0.96, 1e-10, 1e-6, 8e-6, 200.0, -50.0, 1e-7, -1e-7
)
SETS = Ephemerides((ORBIT,))
ANTENNA_M = place_ecef_m(Place(8.0, 47.0, 500.0))


def inertial(position, seconds):
    """Turned into axes that stand still since the time of the ephemeris."""
    sine, cosine = np.sin(TURN_RAD_PER_S * seconds), np.cos(TURN_RAD_PER_S * seconds)
    return np.array([position[0] * cosine - position[1] * sine, position[0] * sine + position[1] * cosine, position[2]])


@pytest.mark.parametrize("after_s", [0.0, 799.999, 800.05])
def test_light_goes_straight_in_axes_that_do_not_turn(after_s):
    (delay,) = foretold_delays_s(SETS, "G07", TOE.plus(after_s), [0.0], ANTENNA_M)
    # that of an orbit's eccentricity, up to 3 m, is all that this satellite's clock is off
    (clock_s,) = ephemeris_clocks_s(SETS, ["G07"], instants(TOE.plus(after_s - delay)))[0]
    flight_s = delay + clock_s
    sent = ephemeris_positions_ecef_m(SETS, ["G07"], instants(TOE.plus(after_s - flight_s)))[0, 0]
    line = inertial(ANTENNA_M, after_s) - inertial(sent, after_s - flight_s)
    assert np.linalg.norm(line) == pytest.approx(C * flight_s, abs=1e-3)


def test_clocks_add_and_a_trajectory_has_a_place_for_each_time():
    times = np.linspace(0.0, 1.0, 11)
    plain = foretold_delays_s(SETS, "G07", TOE, times, ANTENNA_M)
    ahead = Ephemerides((dataclasses.replace(ORBIT, clock_bias_s=2e-4),))
    early = foretold_delays_s(ahead, "G07", TOE, times, ANTENNA_M, clock_s=1e-3)
    # the satellite was a millisecond earlier on its way, which is less than a metre in range
    assert early == pytest.approx(plain + 8e-4, abs=1.0 / C)
    moved = foretold_delays_s(SETS, "G07", TOE, times, ANTENNA_M + np.outer(times, (30.0, 0.0, 0.0)))
    assert moved[0] == plain[0]
    assert 0.0 < abs(moved[-1] - plain[-1]) * C <= 30.0


def test_places_that_do_not_fit_the_times_are_refused():
    with pytest.raises(GnssInputError, match="Each of 2 times needs an antenna's place"):
        foretold_delays_s(SETS, "G07", TOE, [0.0, 1.0], np.ones((3, 3)))
    with pytest.raises(GnssInputError, match="places must be finite"):
        foretold_delays_s(SETS, "G07", TOE, [0.0], np.full(3, np.nan))
    sick = Ephemerides((dataclasses.replace(ORBIT, prn=9, health=1), ORBIT))
    with pytest.raises(GnssInputError, match="G09 is unhealthy"):
        foretold_delays_s(sick, "G09", TOE, [0.0], ANTENNA_M)


DATA = ROOT / "../shared/data"
SIMULATED, BRDC = DATA / "rtk/simulated", DATA / "almanac/rtklib_brdc0910.09n"


@pytest.mark.skipif(not BRDC.exists(), reason="the navigation files of ../shared are not here")
def test_satellites_clocks_are_those_of_rtklib_less_the_group_delay():
    pytest.importorskip("pyrtklib")
    from gnss.differential import read_orbits

    ours, theirs = read_rinex_navigation(BRDC), read_orbits(BRDC)
    for one in ours.sets[::7]:
        if one.health:
            continue
        at = one.toe.plus(1234.5)
        _, clock_s = theirs.state(at.week * 604_800, at.second_of_week, one.id)
        (found,) = ephemeris_clocks_s(ours, [one.id], instants(at))[0]
        assert found == pytest.approx(clock_s - one.group_delay_s, abs=1e-12)


@pytest.mark.skipif(not SIMULATED.exists(), reason="the simulated rover of ../shared is not here")
def test_foretold_delays_are_the_pseudoranges_that_another_simulator_made():
    """A rover on a circle, gps-sdr-sim and a u-blox receiver: what all satellites share is its clock."""
    pytest.importorskip("pyrtklib")
    from gnss.differential import read_observations

    observed, sets = read_observations(SIMULATED / "rover.obs"), read_rinex_navigation(SIMULATED / "rover.nav")
    track = np.loadtxt(SIMULATED / "rover.csv", delimiter=",")
    first = GpsTime(1823, 518_400.0)  # 2014-12-20 00:00:00
    for epoch in (50, 150, 250):
        rows = np.flatnonzero(observed.epoch == epoch)
        since_s = float(observed.time_s[rows[0]] - first.week * 604_800 - first.second_of_week)
        antenna_m = [np.interp(since_s, track[:, 0], axis) for axis in track[:, 1:].T]
        off_m = [
            observed.code_m[row, 0]
            - C * foretold_delays_s(sets, str(observed.satellite[row]), first.plus(since_s), [0.0], antenna_m)[0]
            for row in rows
        ]
        assert len(off_m) >= 8
        assert np.std(off_m) < AIR_M
