"""Baselines: RTKLIB's published answers on real and simulated receivers, and a made-up pair that is known exactly."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from gnss import GnssInputError
from gnss.differential import (
    BaselineSettings,
    Fix,
    HorizonMask,
    hidden_rows,
    parse_observations,
    read_observations,
    read_orbits,
    sent_by,
    single_differences,
    solve_baseline,
)
from tests.gnss.differential import world

DATA = Path(__file__).parents[3] / "../shared/data/rtk"
GPS_EPOCH_S = datetime(1980, 1, 6, tzinfo=UTC).timestamp()


def shared(name):
    path = DATA / name
    if not path.exists():
        pytest.skip(f"rtk/{name} of the shared data is not here")
    return path


@pytest.fixture(scope="module")
def orbits(tmp_path_factory):
    path = tmp_path_factory.mktemp("orbits") / "made.nav"
    path.write_text(world.navigation_text())
    return read_orbits(path)


@pytest.fixture(scope="module")
def pair():
    """Rover on a half circle, base still, both with clocks of their own."""
    rng = np.random.default_rng(3)
    count = 40
    rover = world.heard(world.circle_m(count), rng, clock_m=20.0)
    base = world.heard([world.base_m()] * count, rng, clock_m=-11.0)
    return rover, base


def observed(told, version=2.10):
    return parse_observations(world.observation_text(told, world.base_m(), version), "made.obs")


def test_a_made_up_pair_is_fixed_to_the_noise_of_its_phases(pair, orbits):
    rover, base = (observed(told) for told in pair)
    found = solve_baseline(rover, base, orbits, world.base_m())
    truth = world.circle_m(len(found.fix))
    fixed = found.fix == Fix.FIXED
    assert fixed.mean() > 0.5
    errors_m = np.linalg.norm(found.rover_ecef_m - truth, axis=1)[fixed]
    assert errors_m.max() < 0.02
    assert np.isfinite(found.covariance_m2[fixed]).all()


def test_rinex_2_and_3_hold_the_same(pair, orbits):
    rover, base = pair
    told = [
        solve_baseline(observed(rover, version), observed(base, version), orbits, world.base_m())
        for version in (2.10, 3.02)
    ]
    np.testing.assert_array_equal(told[0].fix, told[1].fix)
    np.testing.assert_allclose(told[0].baseline_ecef_m, told[1].baseline_ecef_m, rtol=0.0, atol=1e-6)


def test_what_is_measured_is_what_was_written(pair):
    rover, _ = pair
    found = observed(rover)
    assert set(found.satellite) == set(rover.rows[0])
    first = found.kept(found.epoch == 0)
    for name, code_m, phase in zip(first.satellite, first.code_m[:, 0], first.phase_cycles[:, 0], strict=True):
        assert (code_m, phase) == pytest.approx(rover.rows[0][str(name)], abs=6e-4)
    assert np.isnan(found.code_m[:, 1]).all()
    np.testing.assert_allclose(found.position_ecef_m, world.base_m(), atol=1e-4)
    seconds = world.START.week * 604_800 + world.START.second_of_week
    assert found.time_s[0] == pytest.approx(seconds, abs=1e-6)


def test_orbits_are_those_that_the_broadcast_algorithm_gives(orbits):
    from gnss import ephemeris_positions_ecef_m, instants

    for seconds in (-3000.0, 0.0, 5000.0):
        time = world.START.plus(seconds)
        whole_s = time.week * 604_800 + int(time.second_of_week)
        expected = ephemeris_positions_ecef_m(world.ORBITS, ["G07"], instants(time))[0, 0]
        np.testing.assert_allclose(orbits.positions_ecef_m(whole_s, 0.0, "G07"), expected, rtol=0.0, atol=0.01)


def test_what_a_satellite_sent_is_where_the_signal_comes_from(pair, orbits):
    rover, _ = pair
    found = observed(rover)
    sent = sent_by(found, orbits, world.base_m())
    places = world.circle_m(len(rover.times))
    for row in (0, len(found) // 2, len(found) - 1):
        epoch = int(found.epoch[row])
        expected_m, _range = world.sent_from(str(found.satellite[row]), rover.times[epoch], places[epoch])
        # the rover's clock of 20 m moves it by 0.3 mm
        np.testing.assert_allclose(sent.position_ecef_m[row], expected_m, rtol=0.0, atol=0.02)
        # relativity alone, for these clocks are right: 2.3e-8 s times the eccentricity over 0.01
        assert abs(sent.clock_m[row]) < 7.0
    with pytest.raises(GnssInputError):
        sent_by(found, orbits, (np.nan, 0.0, 0.0))


def test_satellites_behind_the_terrain_are_left_out(pair, orbits):
    rover, base = (observed(told) for told in pair)
    # the south is hidden up to 40 degrees, and what comes from there anyway came over a detour
    mask = HorizonMask(np.radians([0.0, 89.0, 91.0, 269.0, 271.0]), np.radians([0.0, 0.0, 40.0, 40.0, 0.0]))
    hidden = hidden_rows(rover, orbits, world.PLACE, mask)
    assert 0 < hidden.sum() < len(rover)
    lying = {str(name) for name in rover.satellite[hidden]}
    rover.code_m[hidden] += 40.0
    rover.phase_cycles[hidden] += np.random.default_rng(1).normal(0.0, 2.0, (hidden.sum(), 2))
    truth = world.circle_m(40)
    told = [solve_baseline(rover, base, orbits, world.base_m(), hidden=rows) for rows in (None, hidden)]
    fixed = told[1].fix == Fix.FIXED
    errors_m = [np.linalg.norm(one.rover_ecef_m - truth, axis=1) for one in told]
    assert errors_m[1][fixed].max() < 0.08  # few are left; a wrong fix is off by a wavelength, 0.19 m
    assert fixed.sum() > (told[0].fix == Fix.FIXED).sum()
    assert not lying & set(rover.kept(~hidden).satellite)


def test_double_differences_are_whole_cycles_beside_the_geometry(pair):
    rng = np.random.default_rng(8)
    still = [world.base_m()] * 3
    away = world.circle_m(3)
    rover, base = world.heard(away, rng, 5.0), world.heard(still, rng, -3.0)
    found = single_differences(observed(rover), observed(base)).double(world.in_sight()[0])
    reference = world.in_sight()[0]
    for row, time in enumerate(rover.times):

        def geometry_m(name, time=time, row=row):
            return world.sent_from(name, time, away[row])[1] - world.sent_from(name, time, still[row])[1]

        for column, name in enumerate(found.satellites):
            cycles = found.phase_cycles[row, column] - (geometry_m(name) - geometry_m(reference)) / world.WAVELENGTH_M
            assert abs(cycles - round(cycles)) < 6.0 * 2.0 * world.PHASE_M / world.WAVELENGTH_M


def test_geonet_is_fixed_as_rtklib_fixes_it():
    rover, base = (read_observations(shared(f"geonet/{name}.05o")) for name in ("07590920", "30400920"))
    orbits = read_orbits(shared("geonet/07590920.05n"))
    found = solve_baseline(rover, base, orbits, settings=BaselineSettings(moving=False, frequencies=2))
    solved = found.fix != Fix.NONE
    assert (solved.sum(), (found.fix == Fix.FIXED).sum()) == (115, 115)
    last_m = found.baseline_ecef_m[solved][-1]
    assert np.linalg.norm(last_m - [2022.7712, -468.6304, 2610.2880]) < 0.005
    assert any("header" in told for told in found.warnings)


def test_a_moving_pair_is_fixed_as_rtklib_fixes_it():
    rover, base = (read_observations(shared(f"simulated/{name}.obs")) for name in ("rover", "base"))
    orbits = read_orbits(shared("simulated/base.nav"))
    tracks = [np.loadtxt(shared(f"simulated/{name}.csv"), delimiter=",") for name in ("rover", "base")]
    found = solve_baseline(rover, base, orbits, tracks[1][0, 1:])
    since_s = found.time_s - (datetime(2014, 12, 20, tzinfo=UTC).timestamp() - GPS_EPOCH_S)
    truth = np.stack([np.interp(since_s, tracks[0][:, 0], tracks[0][:, n]) for n in (1, 2, 3)], axis=1)
    fixed = found.fix == Fix.FIXED
    assert len(fixed) == 258
    assert fixed.sum() >= 207
    errors_m = np.linalg.norm(found.rover_ecef_m - truth, axis=1)[fixed]
    assert np.sqrt((errors_m**2).mean()) <= 0.010
    assert errors_m.max() < 0.05  # no wrong fix: those are off by a wavelength or more


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"frequencies": 3}, "frequencies must be 1 or 2"),
        ({"elevation_mask_rad": 2.0}, "elevation_mask_rad"),
        ({"systems": ("X",)}, "systems"),
        ({"ambiguities": "maybe"}, "ambiguities"),
        ({"least_ratio": 0.5}, "least_ratio"),
    ],
)
def test_settings_that_mean_nothing_are_refused(settings, sentence):
    with pytest.raises(GnssInputError, match=sentence):
        BaselineSettings(**settings)


def test_files_of_different_times_are_refused(pair, orbits):
    rover, base = (observed(told) for told in pair)
    late = world.Heard([time.plus(86_400.0) for time in pair[1].times], pair[1].rows)
    with pytest.raises(GnssInputError, match="no time is common"):
        solve_baseline(rover, observed(late), orbits, world.base_m())
    later = [world.Heard([time.plus(86_400.0 * 3) for time in told.times], told.rows) for told in pair]
    with pytest.raises(GnssInputError, match="days away"):
        solve_baseline(observed(later[0]), observed(later[1]), orbits, world.base_m())
    with pytest.raises(GnssInputError, match="three finite"):
        solve_baseline(rover, base, orbits, (0.0, np.nan, 1.0))
