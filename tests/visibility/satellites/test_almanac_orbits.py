"""Where almanacs put their satellites: published differences from precise orbits, and what every orbit must do."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gnss import Almanac, AlmanacEntry, GpsTime, almanac_positions_ecef_m, instants
from gnss.almanac import REFERENCE_INCLINATION_RAD
from gnss.errors import AlmanacError
from gnss.kepler import EARTH_MU_M3_PER_S2, EARTH_RATE_RAD_PER_S
from tests.visibility.satellites.constellation import NOON, satellite, shared_file, walker

ALMANAC_GRADE_M = 1200.0
ORBITS = st.builds(
    satellite,
    eccentricity=st.floats(0.0, 0.03),
    inclination_rad=st.floats(0.0, math.pi),
    sqrt_semi_major_axis_sqrt_m=st.floats(5000.0, 5300.0),
    node_longitude_rad=st.floats(-math.pi, math.pi),
    argument_of_perigee_rad=st.floats(-math.pi, math.pi),
    mean_anomaly_rad=st.floats(-math.pi, math.pi),
)


def turned_back(position_ecef_m, seconds):
    """ECEF positions in axes that stopped turning so many seconds ago."""
    angle = EARTH_RATE_RAD_PER_S * seconds
    x, y, z = np.moveaxis(position_ecef_m, -1, 0)
    return np.stack([x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle), z], axis=-1)


def test_real_almanac_pages_differ_from_precise_orbits_as_published_to_the_millimetre():
    pages = json.loads(shared_file("lnav_almanac_vs_sp3_2015_365.json").read_text())["almanacs"]
    entries = [
        AlmanacEntry(
            prn=page["svid"],
            applicable=GpsTime(page["week_toa"], page["toa"]),
            eccentricity=page["e"],
            inclination_rad=REFERENCE_INCLINATION_RAD + page["delta_i"],
            node_rate_rad_per_s=page["omegadot"],
            sqrt_semi_major_axis_sqrt_m=page["sqrta"],
            node_longitude_rad=page["omega0"],
            argument_of_perigee_rad=page["w"],
            mean_anomaly_rad=page["m0"],
        )
        for page in pages
    ]
    position_ecef_m = almanac_positions_ecef_m(entries, instants(NOON))[:, 0]
    away_m = np.linalg.norm(position_ecef_m - [page["truth_sp3_ecef_m"] for page in pages], axis=1)
    # published to the millimetre, so half of one is rounding
    np.testing.assert_allclose(away_m, [page["gpstk_expected_position_rss_m"] for page in pages], rtol=0, atol=5.01e-4)
    assert sorted(away_m.round(3)) == [601.096, 696.392, 967.847, 968.979, 1042.130, 1169.205]
    assert (away_m <= ALMANAC_GRADE_M).all()


@given(ORBITS, st.floats(-1e6, 1e6))
def test_the_radius_stays_between_perigee_and_apogee(entry, seconds):
    position_ecef_m = almanac_positions_ecef_m([entry], instants(entry.applicable.plus(seconds)))
    radius_m = np.linalg.norm(position_ecef_m)
    assert entry.semi_major_axis_m * (1 - entry.eccentricity) <= radius_m * (1 + 1e-12)
    assert radius_m * (1 - 1e-12) <= entry.semi_major_axis_m * (1 + entry.eccentricity)


@given(ORBITS)
def test_after_one_period_the_satellite_is_back_in_its_plane(entry):
    still = AlmanacEntry(**{**{name: getattr(entry, name) for name in entry.__slots__}, "node_rate_rad_per_s": 0.0})
    period_s = 2 * math.pi * math.sqrt(entry.semi_major_axis_m**3 / EARTH_MU_M3_PER_S2)
    assert 10.5 * 3600 < period_s < 13.5 * 3600
    start, end = almanac_positions_ecef_m([still], instants([entry.applicable, entry.applicable.plus(period_s)]))[0]
    assert np.linalg.norm(turned_back(end, period_s) - start) < 1e-2
    halfway = almanac_positions_ecef_m([still], instants(entry.applicable.plus(period_s / 2)))[0, 0]
    assert np.linalg.norm(turned_back(halfway, period_s / 2) - start) > 1.9 * entry.semi_major_axis_m * 0.95


@given(ORBITS, st.floats(-1e5, 1e5))
@settings(deadline=None)
def test_the_motion_obeys_gravity(entry, seconds):
    still = AlmanacEntry(**{**{name: getattr(entry, name) for name in entry.__slots__}, "node_rate_rad_per_s": 0.0})
    step_s = 10.0
    around_s = np.array([-step_s, 0.0, step_s])
    times = instants([entry.applicable.plus(seconds + s) for s in around_s])
    before, here, after = turned_back(almanac_positions_ecef_m([still], times)[0], around_s)
    acceleration = (after - 2 * here + before) / step_s**2
    expected = -EARTH_MU_M3_PER_S2 * here / np.linalg.norm(here) ** 3
    np.testing.assert_allclose(acceleration, expected, rtol=0, atol=1e-6)  # of 0.56 m/s²


def test_a_satellite_at_its_node_stands_over_the_equator_where_table_ii_puts_it():
    entry = satellite(mean_anomaly_rad=0.0, argument_of_perigee_rad=0.0, applicable=GpsTime(1877, 1000.0))
    x, y, z = almanac_positions_ecef_m([entry], instants(GpsTime(1877, 1000.0)))[0, 0]
    assert z == 0.0
    assert math.atan2(y, x) == pytest.approx(entry.node_longitude_rad - EARTH_RATE_RAD_PER_S * 1000.0, abs=1e-14)
    assert math.hypot(x, y) == pytest.approx(entry.semi_major_axis_m * (1 - entry.eccentricity), rel=1e-14)


def test_many_satellites_at_many_times_are_each_as_if_alone():
    entries = walker().entries
    times = [GpsTime(1877, 600.0 * n) for n in range(5)] + [GpsTime(1878, 3.5)]
    together = almanac_positions_ecef_m(entries, instants(times))
    assert together.shape == (24, 6, 3)
    for row, column in [(0, 0), (7, 3), (23, 5)]:
        alone = almanac_positions_ecef_m([entries[row]], instants(times[column]))[0, 0]
        np.testing.assert_allclose(together[row, column], alone, rtol=0, atol=1e-7)


def test_the_end_of_a_week_is_no_seam():
    entry = satellite()
    seam = GpsTime(1878, 0.0)
    before, after = almanac_positions_ecef_m([entry], instants([seam.plus(-1e-3), seam.plus(1e-3)]))[0]
    assert np.linalg.norm(after - before) < 10.0  # 2 ms at 4 km/s


def test_an_almanac_of_another_week_is_refused_unless_its_age_is_allowed():
    almanac = walker()
    late = GpsTime(1877 + 1024, 0.0)
    with pytest.raises(AlmanacError, match=r"of GPS week 1877 \(2016-01-01\), 7162 days before the time asked for"):
        almanac_positions_ecef_m(almanac.entries, instants(late))
    with pytest.raises(AlmanacError, match=r"days after the time asked for \(limit 28 days\)"):
        almanac_positions_ecef_m(almanac.entries, instants([GpsTime(1877, 0.0), GpsTime(1872, 0.0)]))
    assert np.isfinite(almanac_positions_ecef_m(almanac.entries, instants(late), math.inf)).all()
    with pytest.raises(AlmanacError):
        almanac_positions_ecef_m(almanac.entries, instants(NOON), math.nan)


def test_an_almanac_without_use_is_refused():
    with pytest.raises(AlmanacError, match="has no satellite in it"):
        Almanac(())
    with pytest.raises(AlmanacError, match="All 2 satellites of the almanac sick are unhealthy"):
        _ = Almanac((satellite(1, health=63), satellite(2, health=1)), "sick").healthy


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"prn": 0}, "numbers from 1 to 63, not 0"),
        ({"eccentricity": math.nan}, "G01: eccentricity must be a finite number"),
        ({"mean_anomaly_rad": math.inf}, "mean_anomaly_rad must be a finite number"),
        ({"eccentricity": 1.0}, "0 <= e < 1"),
        ({"inclination_rad": -0.1}, "inclination must lie in 0…180 deg"),
        ({"sqrt_semi_major_axis_sqrt_m": 2000.0}, "semi-major axis must lie in"),
    ],
)
def test_impossible_orbits_are_refused(fields, words):
    with pytest.raises(AlmanacError, match=words):
        satellite(**fields)
