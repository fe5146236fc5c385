"""Kepler's equation, and orbits as geometry has them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss.errors import AlmanacError
from gnss.kepler import eccentric_anomaly_rad, ecef_of_orbit_m, true_anomaly_rad

ECCENTRICITIES = st.floats(0.0, 0.99)
ANGLES_RAD = st.floats(-1000.0, 1000.0)


@given(ANGLES_RAD, ECCENTRICITIES)
def test_the_solution_satisfies_keplers_equation(mean_rad, e):
    anomaly_rad = eccentric_anomaly_rad(mean_rad, e)
    turned_rad = anomaly_rad - e * np.sin(anomaly_rad) - mean_rad
    # what is left after whole turns; the turns themselves round at 1000 rad
    assert abs(turned_rad - 2 * np.pi * np.round(turned_rad / (2 * np.pi))) < 5e-13


@given(st.floats(-np.pi, np.pi), ECCENTRICITIES)
def test_an_anomaly_comes_back_from_its_mean_anomaly(anomaly_rad, e):
    found_rad = float(eccentric_anomaly_rad(anomaly_rad - e * np.sin(anomaly_rad), e))
    away = found_rad - anomaly_rad
    assert abs(np.sin(away / 2)) < 1e-12


def test_a_circle_needs_no_solving():
    mean_rad = np.linspace(-3.0, 3.0, 61)
    np.testing.assert_array_equal(eccentric_anomaly_rad(mean_rad, 0.0), mean_rad)
    np.testing.assert_allclose(true_anomaly_rad(mean_rad, 0.0), mean_rad, atol=1e-15)


def test_satellites_and_times_broadcast():
    assert eccentric_anomaly_rad(np.zeros((1, 7)), np.zeros((5, 1))).shape == (5, 7)


def test_nothing_known_stays_unknown_and_disturbs_no_other():
    solved = eccentric_anomaly_rad([np.nan, 1.0], 0.3)
    assert np.isnan(solved[0])
    assert solved[1] - 0.3 * np.sin(solved[1]) == pytest.approx(1.0, abs=1e-13)


@given(st.floats(-np.pi, np.pi), ECCENTRICITIES)
def test_both_anomalies_give_one_radius(anomaly_rad, e):
    true_rad = true_anomaly_rad(np.float64(anomaly_rad), e)
    assert 1 - e * np.cos(anomaly_rad) == pytest.approx((1 - e * e) / (1 + e * np.cos(true_rad)), rel=1e-9)


@given(st.floats(1e6, 1e8), ANGLES_RAD, st.floats(0.0, np.pi), ANGLES_RAD)
def test_an_orbit_plane_keeps_radius_and_inclination(radius_m, argument_rad, inclination_rad, node_rad):
    position_ecef_m = ecef_of_orbit_m(np.float64(radius_m), np.float64(argument_rad), inclination_rad, node_rad)
    assert np.linalg.norm(position_ecef_m) == pytest.approx(radius_m, rel=1e-12)
    normal = np.array(
        [
            np.sin(inclination_rad) * np.sin(node_rad),
            -np.sin(inclination_rad) * np.cos(node_rad),
            np.cos(inclination_rad),
        ]
    )
    assert abs(position_ecef_m @ normal) < 1e-9 * radius_m


@pytest.mark.parametrize("e", [-0.1, 1.0, np.nan])
def test_orbits_that_do_not_close_are_refused(e):
    with pytest.raises(AlmanacError, match="0 <= e < 1"):
        eccentric_anomaly_rad(1.0, e)
