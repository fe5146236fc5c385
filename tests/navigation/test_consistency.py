"""A filter whose noise is as stated tells the truth about itself: NEES and NIS within two-sided bounds."""

import numpy as np
import pytest

from navigation import MeasurementError, StateError, mean_bounds, nees
from navigation.kernels.ranges import USED
from navigation.kernels.tracks import step_many
from tests.navigation.worlds import ANCHORS_M, MOTION, belief
from tests.reference import kalman

RUNS, STEPS, SIGMA_M = 200, 60, 0.5


def monte_carlo(clock, noise_factor=1.0, seed=11):
    """(mean NEES, mean NIS per range, ranges) over runs whose truth is drawn from the filter's own model."""
    rng = np.random.default_rng(seed)
    state = belief(clock)
    n = state.mean.size
    psd = MOTION.psd()
    q = np.linalg.cholesky(kalman.process_noise(psd[: n // 2], 1.0))
    f = kalman.transition(n, 1.0)
    truth = state.mean + rng.normal(size=(RUNS, n)) * np.sqrt(np.diag(state.covariance))
    means, covariances = np.tile(state.mean, (RUNS, 1)), np.tile(state.covariance, (RUNS, 1, 1))
    found = np.zeros((RUNS, len(ANCHORS_M), 3))
    for _ in range(STEPS):
        truth = truth @ f.T + rng.normal(size=(RUNS, n)) @ q.T
        ranges_m = np.array([kalman.expected_ranges(one, ANCHORS_M) for one in truth])
        ranges_m += rng.normal(0.0, noise_factor * SIGMA_M, ranges_m.shape)
        variances = np.full(ranges_m.shape, SIGMA_M**2)
        ungated = np.inf, np.zeros((len(means), 1))
        step_many(means, covariances, 1.0, psd, ANCHORS_M, (ranges_m, variances), ungated, found)
    assert (found[..., 2] == USED).all()
    nis = (found[..., 0] ** 2 / found[..., 1]).sum(axis=1)
    return nees(truth - means, covariances).mean(), nis.mean()


@pytest.mark.parametrize("clock", [False, True], ids=["ranging", "pseudoranges"])
def test_nees_and_nis_lie_within_two_sided_bounds(clock):
    mean_nees, mean_nis = monte_carlo(clock)
    low, high = mean_bounds(8 if clock else 6, RUNS)
    assert low <= mean_nees <= high
    low, high = mean_bounds(len(ANCHORS_M), RUNS)
    assert low <= mean_nis <= high


@pytest.mark.parametrize("factor", [0.7, 1.4])
def test_noise_that_is_not_as_stated_falls_out_on_its_side(factor):
    _, mean_nis = monte_carlo(False, factor)
    low, high = mean_bounds(len(ANCHORS_M), RUNS)
    assert mean_nis < low if factor < 1.0 else mean_nis > high


def test_the_bounds_are_the_published_ones():
    # Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 5.4.2: 50 runs, 2 states
    assert mean_bounds(2, 50) == pytest.approx((1.48, 2.59), abs=0.01)


def test_shapes_that_do_not_fit_are_refused():
    with pytest.raises(StateError):
        nees(np.zeros((3, 2)), np.zeros((3, 3, 3)))
    with pytest.raises(MeasurementError):
        mean_bounds(0, 5)
