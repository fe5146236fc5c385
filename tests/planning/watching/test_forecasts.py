"""Probabilities of sight over the place's and the ground's uncertainty, against what many draws of both come to."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
import scipy.optimize
import scipy.stats

from planning import WatchError
from planning.kernels.forecasts import free_place
from planning.watching import GroundErrors, SightForecast, forecast_sight
from planning.watching.forecasts import sight_probability
from terrain import ElevationGrid, height_at
from tests.planning.watching.grounds import ANTENNA_M, Floats, anchors, on_ground, ridge, rough
from visibility import lines_of_sight

SURE = GroundErrors(dem_sigma_m=1e-3, shift_sigma_m=0.0)
ANCHORS_M = np.array([(a.east_m, a.north_m, a.altitude_m) for a in anchors()])


def forecast(grid: ElevationGrid, place_m: tuple[float, float], sigma_m: float, errors: GroundErrors) -> SightForecast:
    told = forecast_sight(grid, place_m, sigma_m**2 * np.eye(2), ANCHORS_M, ANTENNA_M, errors=errors)
    assert told is not None
    return told


def share_in_sight(grid: ElevationGrid, antennas_m: Floats) -> Floats:
    k, n = len(ANCHORS_M), len(antennas_m)
    lines = lines_of_sight(grid, np.repeat(antennas_m, k, axis=0), np.tile(ANCHORS_M, (n, 1)))
    shares: Floats = (lines.clearance_m > 0.0).reshape(n, k).mean(axis=0)
    return shares


@pytest.mark.parametrize("sigma_m", [5.0, 20.0, 40.0])
@pytest.mark.parametrize("place_m", [(380.0, 300.0), (440.0, 500.0), (560.0, 250.0), (330.0, 620.0)])
def test_over_the_place_it_is_the_share_of_many_draws(place_m: tuple[float, float], sigma_m: float) -> None:
    generator = np.random.default_rng(3)
    grid = ridge(rough(generator, 60.0, 2.0))
    drawn_m = np.array(place_m) + sigma_m * generator.standard_normal((4000, 2))
    expected = share_in_sight(grid, on_ground(grid, *drawn_m.T))
    told = forecast(grid, place_m, sigma_m, SURE).p_sight
    assert np.abs(told - expected).max() < 0.1
    assert np.abs(told - expected).mean() < 0.04


@pytest.mark.parametrize("place_m", [(380.0, 300.0), (440.0, 500.0), (330.0, 620.0)])
def test_over_the_ground_it_is_the_share_of_many_grounds(place_m: tuple[float, float]) -> None:
    generator = np.random.default_rng(4)
    errors = GroundErrors(dem_sigma_m=4.0, correlation_m=200.0, shift_sigma_m=0.0)
    counts = np.zeros(len(ANCHORS_M))
    for _ in range(300):
        ground = ridge(rough(generator, 200.0, 4.0))
        counts += share_in_sight(ground, on_ground(ground, *np.array([place_m]).T))
    told = forecast(ridge(), place_m, 0.5, errors).p_sight
    assert np.abs(told - counts / 300).max() < 0.12  # three sigma of 300 draws are 0.09


def test_a_map_that_may_lie_elsewhere_is_a_place_that_may() -> None:
    shifted = GroundErrors(dem_sigma_m=1e-3, shift_sigma_m=20.0)
    moved = forecast(ridge(), (440.0, 500.0), 1e-3, shifted).p_sight
    assert np.allclose(moved, forecast(ridge(), (440.0, 500.0), 20.0, SURE).p_sight, atol=1e-3)


def test_a_grazed_ridge_hides_but_hardly_lengthens() -> None:
    place_m = (380.0, 300.0)
    grid = ridge(ridge_m=26.0)
    told = forecast_sight(grid, place_m, 0.01 * np.eye(2), ANCHORS_M, ANTENNA_M, excess_m=2.0, errors=SURE)
    assert told is not None
    antenna_m = on_ground(grid, *np.array([place_m]).T)
    lines = lines_of_sight(grid, np.repeat(antenna_m, 8, axis=0), ANCHORS_M, excess_path=True)
    assert lines.excess_path_m is not None
    grazed = (lines.excess_path_m > 0.0) & (lines.excess_path_m < 1.0)
    assert grazed.any()
    assert (told.p_sight[grazed] < 0.05).all()
    assert (told.p_direct[grazed] > 0.95).all()
    assert np.allclose(told.clearance_m, lines.clearance_m, atol=1e-6)


def test_the_height_of_the_ground_is_a_plane_with_what_departs_from_it() -> None:
    grid = ridge(ridge_m=0.0)
    ground = forecast(grid, (300.0, 400.0), 5.0, GroundErrors(2.0, shift_sigma_m=10.0)).ground
    assert ground.altitude_m == pytest.approx(float(height_at(grid, 300.0, 400.0)) + ANTENNA_M, abs=1e-3)
    assert (ground.slope_east, ground.slope_north) == pytest.approx((0.0, 0.05), abs=1e-5)
    assert ground.sigma_m == pytest.approx(math.hypot(2.0, 0.05 * 10.0), abs=1e-3)
    rough_m = forecast(ridge(rough(np.random.default_rng(1), 20.0, 3.0)), (300.0, 400.0), 40.0, SURE).ground.sigma_m
    assert 1.5 < rough_m < 4.5


def test_where_the_map_knows_no_ground_it_says_nothing() -> None:
    assert forecast_sight(ridge(), (-50.0, 100.0), np.eye(2), ANCHORS_M) is None
    assert forecast_sight(ridge(), (100.0, 100.0), 1e9 * np.eye(2), ANCHORS_M) is None
    assert forecast_sight(ridge(), (math.nan, 100.0), np.eye(2), ANCHORS_M) is None
    hole = np.zeros((81, 81))
    hole[:, 60:64] = math.nan
    told = forecast(ridge(hole), (380.0, 300.0), 1.0, GroundErrors())
    assert np.isnan(told.p_sight[:3]).all()
    assert np.isfinite(told.p_sight[3:]).all()


def test_errors_that_are_none_are_refused() -> None:
    with pytest.raises(WatchError, match="dem_sigma_m"):
        GroundErrors(dem_sigma_m=0.0)
    with pytest.raises(WatchError, match="shift_sigma_m"):
        GroundErrors(shift_sigma_m=-1.0)
    with pytest.raises(WatchError, match="antenna_above_ground_m"):
        forecast_sight(ridge(), (100.0, 100.0), np.eye(2), ANCHORS_M, -1.0)


def test_eight_anchors_take_about_a_millisecond() -> None:
    grid, times_s = ridge(), []
    for _ in range(50):
        begin_s = time.process_time()
        forecast(grid, (380.0, 300.0), 5.0, GroundErrors())
        times_s.append(time.process_time() - begin_s)
    assert np.median(times_s) < 0.003  # 0.4 ms where nothing else runs


def test_the_odds_of_lines_are_the_normal_distribution_of_their_clearance_over_what_it_errs() -> None:
    generator = np.random.default_rng(5)
    reach_m = generator.uniform(1.0, 5000.0, 500)
    away_m = reach_m * generator.uniform(0.0, 1.0, 500)
    clearance_m = generator.normal(0.0, 10.0, 500)
    clearance_m[:3] = np.nan, np.inf, -np.inf
    errors = GroundErrors(dem_sigma_m=2.0, correlation_m=150.0)
    lifted = 1.0 - away_m / reach_m
    variance = np.maximum(1.0 + lifted**2 - 2.0 * lifted * np.exp(-away_m / 150.0), 1e-4)
    expected = scipy.stats.norm.cdf(clearance_m / (2.0 * np.sqrt(variance)))
    told = sight_probability(clearance_m, away_m, reach_m, errors)
    np.testing.assert_allclose(told, expected, rtol=0.0, atol=1e-12)


def test_a_place_where_ranges_meet_is_that_of_least_squares() -> None:
    generator = np.random.default_rng(6)
    anchors_m, truth_m = generator.uniform(-300.0, 300.0, (7, 3)), np.array([20.0, -30.0, 5.0])
    ranges_m = np.linalg.norm(anchors_m - truth_m, axis=1) + generator.normal(0.0, 0.1, 7)
    sigmas_m = generator.uniform(0.05, 0.3, 7)
    found = scipy.optimize.least_squares(
        lambda at_m: (np.linalg.norm(anchors_m - at_m, axis=1) - ranges_m) / sigmas_m, truth_m, xtol=1e-14, gtol=1e-14
    )
    over, place_m = np.array([0.2, -0.1, 1.0]), truth_m + 3.0
    variance_m2, moved_m, _ = free_place(anchors_m, ranges_m, sigmas_m, over, 20, place_m)
    assert place_m == pytest.approx(found.x, abs=1e-6)
    assert moved_m < 1e-9
    assert variance_m2 >= over @ np.linalg.inv(found.jac.T @ found.jac) @ over * (1.0 - 1e-6)
