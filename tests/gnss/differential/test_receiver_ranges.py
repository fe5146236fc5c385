"""What one receiver heard, put right: a real station's ranges from its known place, clocks that jump, lost cycles."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gnss import GnssInputError
from gnss.differential import parse_observations, parse_orbits, read_observations, read_orbits, receiver_ranges
from tests.gnss.differential import world
from tests.gnss.differential.test_precise_orbits import sp3_text

DATA = Path(__file__).parents[3] / "../shared/data/rtk"
MILLISECOND_M = world.LIGHT * 1e-3


@pytest.fixture(scope="module")
def orbits():
    return parse_orbits([(world.navigation_text(), "made.nav")])


@pytest.fixture(scope="module")
def observed():
    rng = np.random.default_rng(5)
    told = world.heard(world.circle_m(12), rng, clock_m=20.0)
    return parse_observations(world.observation_text(told, world.base_m()), "made.obs")


def test_a_stations_ranges_are_those_from_where_it_stands():
    path = DATA / "geonet/07590920.05o"
    if not path.exists():
        pytest.skip("rtk/geonet of the shared data is not here")
    station = read_observations(path)
    found = receiver_ranges(station, read_orbits(path.with_suffix(".05n")))
    # a header's place, to metres, which codes with the air's models are good to as well
    assert np.linalg.norm(found.place_ecef_m - station.position_ecef_m) < 5.0
    lengths_m = np.linalg.norm(found.position_ecef_m - station.position_ecef_m, axis=1)
    high = found.elevation_rad > np.radians(15.0)
    codes, phases = [], []
    before = {}
    for time_s in np.unique(found.time_s):
        rows = np.flatnonzero((found.time_s == time_s) & high)
        off_m = found.code_m[rows] - lengths_m[rows]
        codes.append(off_m - np.median(off_m))
        now = {found.satellite[row]: (found.arc[row], found.phase_m[row] - lengths_m[row]) for row in rows}
        moved = [now[one][1] - before[one][1] for one in now.keys() & before.keys() if now[one][0] == before[one][0]]
        if moved:
            phases.append(np.array(moved) - np.median(moved))
        before = now
    assert np.sqrt(np.mean(np.concatenate(codes) ** 2)) < 1.5
    # in 30 s; without the air's models or the satellites' clocks it is decimetres
    assert np.median(np.abs(np.concatenate(phases))) < 0.03


def test_codes_and_phases_are_ranges_and_their_changes(observed, orbits):
    found = receiver_ranges(observed, orbits)
    places_m = world.circle_m(12)
    epoch = np.unique(found.time_s, return_inverse=True)[1]
    lengths_m = np.linalg.norm(found.position_ecef_m - places_m[epoch], axis=1)
    for name in np.unique(found.satellite):
        mine = found.satellite == name
        codes, phases = (values[mine] - lengths_m[mine] for values in (found.code_m, found.phase_m))
        # the world has no air: what is left is the models' delay, which does not change within seconds
        assert np.ptp(codes) < 8.0 * world.CODE_M
        assert np.ptp(phases) < 8.0 * world.PHASE_M + 0.02
    assert found.warnings == ()


@pytest.mark.parametrize("phases_too", [True, False])
def test_a_clock_that_jumps_by_milliseconds_does_not(observed, orbits, phases_too):
    late = observed.epoch >= 5
    codes = observed.code_m + np.where(late, MILLISECOND_M, 0.0)[:, None]
    cycles = observed.phase_cycles + np.where(late & phases_too, MILLISECOND_M / world.WAVELENGTH_M, 0.0)[:, None]
    # the same signals at another reading of the clock
    jumped = replace(observed, code_m=codes, phase_cycles=cycles, part_s=observed.part_s + np.where(late, 1e-3, 0.0))
    still, found = receiver_ranges(observed, orbits), receiver_ranges(jumped, orbits)
    np.testing.assert_allclose(found.code_m, still.code_m, atol=0.01)
    np.testing.assert_allclose(found.phase_m, still.phase_m, atol=0.01)
    np.testing.assert_allclose(found.time_s, still.time_s, atol=1e-6)


class WithoutClocks:
    """Orbits as SP3 files have them that know no clocks."""

    def __init__(self, orbits):
        self.orbits = orbits

    def state(self, whole_s, part_s, satellite):
        return self.orbits.positions_ecef_m(whole_s, part_s, satellite), 0.0


def test_precise_orbits_serve_as_well_with_the_broadcast_clocks_where_they_have_none(observed, orbits):
    names = sorted(set(observed.satellite.tolist()))
    text = sp3_text(WithoutClocks(orbits), names, (orbits.first_s + orbits.last_s) / 2.0)
    precise = parse_orbits([(world.navigation_text(), "made.nav"), (text, "made.sp3")])
    assert precise.precise
    broadcast, found = receiver_ranges(observed, orbits), receiver_ranges(observed, precise)
    np.testing.assert_array_equal(found.satellite, broadcast.satellite)
    np.testing.assert_allclose(found.position_ecef_m, broadcast.position_ecef_m, atol=0.1)
    np.testing.assert_allclose(found.code_m, broadcast.code_m, atol=0.5)


def test_phases_of_another_clock_than_codes_are_put_right_and_told(orbits):
    rng = np.random.default_rng(6)
    told = world.heard(world.circle_m(40), rng, clock_m=20.0)
    heard = parse_observations(world.observation_text(told, world.base_m()), "made.obs")
    away_cycles = 0.25 / world.WAVELENGTH_M * (heard.time_s - heard.time_s[0])
    whole = receiver_ranges(heard, orbits)
    found = receiver_ranges(replace(heard, phase_cycles=heard.phase_cycles - away_cycles[:, None]), orbits)
    assert whole.warnings == ()
    assert found.warnings == ("Codes and phases drift apart by 0.25 m/s, which was made up for in the phases.",)
    left_m = found.phase_m - whole.phase_m
    assert np.abs(left_m).max() < 0.01 * 40.0
    np.testing.assert_array_equal(found.code_m, whole.code_m)


def test_lost_cycles_begin_another_arc(observed, orbits):
    slip = observed.slip.copy()
    row = int(np.flatnonzero((observed.epoch == 6) & (observed.satellite == observed.satellite[0]))[0])
    slip[row, 0] = 1
    found = receiver_ranges(replace(observed, slip=slip), orbits)
    mine = found.arc[found.satellite == observed.satellite[0]]
    np.testing.assert_array_equal(mine, np.repeat([0, 1], 6))
    assert (found.arc[found.satellite != observed.satellite[0]] == 0).all()


def test_what_tells_no_place_is_refused(observed, orbits):
    with pytest.raises(GnssInputError, match="no observations"):
        receiver_ranges(observed.kept(np.zeros(len(observed), bool)), orbits)
    three = np.isin(observed.satellite, np.unique(observed.satellite)[:3])
    with pytest.raises(GnssInputError, match=r"At no epoch of made\.obs codes of four GPS satellites"):
        receiver_ranges(observed.kept(three), orbits)
    late = replace(observed, whole_s=observed.whole_s + 5 * 86_400)
    with pytest.raises(GnssInputError, match="days away"):
        receiver_ranges(late, orbits)


def test_satellites_without_orbits_are_told(observed):
    names = np.unique(observed.satellite)
    some = replace(world.ORBITS, sets=tuple(one for one in world.ORBITS.sets if one.id != names[0]))
    found = receiver_ranges(observed, parse_orbits([(world.navigation_text(some), "made.nav")]))
    assert found.warnings == (f"Satellites without an orbit at some time, not used then: {names[0]}.",)
    assert names[0] not in found.satellite
