"""The experiment of the safety bubble: what is simulated is what it says, and the tables judge it."""

import math

import numpy as np
import pytest

from benchmarks.navigation.bubble_case import DRONES, REFLECTION_REACH_M, Draws, drone_case, heard
from benchmarks.navigation.bubble_filters import Method, bend_m2, fly_filters
from benchmarks.navigation.consistency import shares_inside
from benchmarks.navigation.plaza_track import plaza_track
from benchmarks.visibility.paper_case import DEM_FILE, read_mountains

pytestmark = pytest.mark.skipif(not DEM_FILE.exists(), reason="needs ../shared/data")


@pytest.fixture(scope="module")
def case():
    return drone_case(read_mountains(), every=30)


def test_a_hidden_drone_is_heard_late_or_not_at_all(case):
    sight, excess_m = case.in_sight[0], case.excess_m[0]
    assert 0.3 < sight.mean() < 1.0
    assert np.isnan(excess_m[sight]).all()
    assert 0 < np.isfinite(excess_m[~sight]).sum() < np.count_nonzero(~sight)
    # there and back from the farthest ground that is heard
    assert (excess_m[np.isfinite(excess_m)] > 0.0).all()
    assert np.nanmax(excess_m) <= 2.0 * REFLECTION_REACH_M


def test_what_is_heard_is_the_way_and_its_errors(case):
    draws = Draws(case, 400, np.random.default_rng(1))
    measured_m = heard(case, 0, 3, draws)
    straight_m = np.linalg.norm(case.legs[0].anchors_m - case.points_m[3], axis=1)
    sight = case.in_sight[0][3]
    off_m = (measured_m - straight_m)[:, sight]
    assert measured_m.shape == (400, DRONES)
    assert abs(off_m.mean()) < 5.0 * case.noise.receiver_m / math.sqrt(off_m.size)
    assert off_m.std() == pytest.approx(case.noise.receiver_m, rel=0.1)


def test_the_proposed_filter_begins_with_drones_in_sight_only_and_stays_a_belief(case):
    (track,) = fly_filters(case, [Method("proposed", math.inf, 5.0)], 4, 3)
    assert (track.used[:, 0] <= case.in_sight[0][0].sum()).all()
    assert np.isfinite(track.error_m).all()
    assert (np.linalg.eigvalsh(track.covariance_m2) > 0.0).all()


def test_the_bend_of_a_range_is_what_a_wide_belief_adds_to_its_scatter():
    covariance = np.zeros((1, 6, 6))
    covariance[0, ::2, ::2] = np.diag([900.0, 400.0, 100.0])
    line_m = np.array([0.0, 300.0, 400.0])
    generator = np.random.default_rng(4)
    off_m = generator.multivariate_normal(np.zeros(3), covariance[0, ::2, ::2], 200_000)
    beyond_m = np.linalg.norm(line_m + off_m, axis=1) - 500.0 - off_m @ line_m / 500.0
    assert bend_m2(line_m[None, None], covariance)[0, 0] == pytest.approx(np.mean(beyond_m**2), rel=0.1)


def test_the_consistency_that_is_judged_fails_where_late_ranges_are_taken_in():
    assert min(shares_inside(60, 60, 2, hidden=True, excluded=True)) > 0.8
    assert max(shares_inside(60, 60, 2, hidden=True, excluded=False)) < 0.2


def test_plaza_is_tracked_by_ranges_and_odometry_within_sixty_centimetres():
    track = plaza_track()
    assert math.sqrt(np.mean(track.distance_m**2)) <= 0.6
    assert np.mean(track.distance_m <= 3.0 * np.sqrt(np.trace(track.covariance_m2, axis1=1, axis2=2))) >= 0.97
