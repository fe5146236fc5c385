"""Logs of ranges that come one by one, for a long time, and many filters side by side."""

import math

import numpy as np
import pytest

from navigation import MeasurementError, TimeOrderError, filter_ranges, predict, update_range, update_ranges
from navigation.kernels.tracks import step_many
from tests.navigation.worlds import ANCHORS_M, MOTION, belief, true_ranges_m


def log(count, seed=3, noise_m=0.5):
    rng = np.random.default_rng(seed)
    times_s = np.cumsum(rng.exponential(0.1, count))
    which = rng.integers(0, len(ANCHORS_M), count)
    places_m = np.column_stack([2.0 * times_s, -1.0 * times_s, np.full(count, 20.0)])
    measured_m = np.linalg.norm(places_m - ANCHORS_M[which], axis=1) + rng.normal(0.0, noise_m, count)
    return times_s, which, measured_m, places_m


def test_a_log_is_what_single_updates_in_a_loop_would_give():
    times_s, which, measured_m, _ = log(60)
    measured_m[7] = math.nan
    measured_m[20] += 400.0
    found = filter_ranges(belief(False), MOTION, times_s, which, measured_m, 0.25, ANCHORS_M, gate_sigma=6.0)
    state = belief(False)
    for number, (time_s, anchor, range_m) in enumerate(zip(times_s, which, measured_m, strict=True)):
        update = update_range(state, time_s, MOTION, ANCHORS_M[anchor], range_m, 0.25, gate_sigma=6.0)
        state = update.state
        np.testing.assert_allclose(found.mean[number], state.mean, rtol=1e-12)
        np.testing.assert_allclose(found.position_covariance_m2[number], state.position_covariance_m2, rtol=1e-12)
        assert found.verdict[number] == update.verdict[0]
    np.testing.assert_array_equal(found.state.covariance, state.covariance)
    assert found.verdict[[7, 20]].tolist() == [0, 2]


def test_single_ranges_find_the_way():
    times_s, which, measured_m, places_m = log(3000)
    found = filter_ranges(belief(False), MOTION, times_s, which, measured_m, 0.25, ANCHORS_M)
    error_m = np.linalg.norm(found.position_m - places_m, axis=1)[500:]
    assert np.sqrt(np.mean(error_m**2)) < 0.8


def test_numbers_stay_finite_over_a_million_ranges_with_outages_and_certainty():
    count = 1_000_000
    rng = np.random.default_rng(9)
    times_s = np.cumsum(rng.choice([0.0, 0.1, 1e5], count, p=[0.2, 0.7995, 0.0005]))
    which = rng.integers(0, len(ANCHORS_M), count)
    measured_m = np.linalg.norm(ANCHORS_M[which] - (3.0, -4.0, 20.0), axis=1) + rng.normal(0.0, 0.01, count)
    variances_m2 = rng.choice([1e-10, 1.0, 1e10, np.inf], count)
    found = filter_ranges(belief(False), MOTION, times_s, which, measured_m, variances_m2, ANCHORS_M)
    assert np.isfinite(found.mean).all()
    assert np.isfinite(found.position_covariance_m2).all()
    assert np.linalg.eigvalsh(found.position_covariance_m2[::97]).min() > 0.0


def test_filters_side_by_side_are_each_the_one_alone():
    rng = np.random.default_rng(4)
    state = belief(True)
    measured_m = true_ranges_m((3.0, -4.0, 20.0), clock_m=30.0) + rng.normal(size=(5, len(ANCHORS_M)))
    variances_m2 = rng.choice([0.25, np.inf], (5, len(ANCHORS_M)))
    means, covariances = np.tile(state.mean, (5, 1)), np.tile(state.covariance, (5, 1, 1))
    found = np.zeros((5, len(ANCHORS_M), 3))
    gate = 25.0, np.zeros((5, 1))
    step_many(means, covariances, 0.5, MOTION.psd(), ANCHORS_M, (measured_m, variances_m2), gate, found)
    later = predict(state, 0.5, MOTION)
    for number in range(5):
        alone = update_ranges(later, ANCHORS_M, measured_m[number], variances_m2[number], gate_sigma=5.0)
        np.testing.assert_allclose(means[number], alone.state.mean, rtol=1e-12)
        np.testing.assert_allclose(covariances[number], alone.state.covariance, rtol=1e-12)
        np.testing.assert_array_equal(found[number, :, 2], alone.verdict)


@pytest.mark.parametrize(
    ("changed", "error", "sentence"),
    [
        ({"times_s": [1.0, 0.5]}, TimeOrderError, "0.5 s follows 1.0 s at range 1"),
        ({"times_s": [-1.0, 0.5]}, TimeOrderError, "at range 0"),
        ({"times_s": [1.0, math.nan]}, TimeOrderError, "at range 1"),
        ({"anchor_numbers": [0, 9]}, MeasurementError, "one of 6 anchors"),
        ({"anchor_numbers": [0.0, 1.0]}, MeasurementError, "whole numbers"),
        ({"measured_m": [1.0, math.inf]}, MeasurementError, "finite or NaN"),
        ({"variances_m2": [1.0, 0.0]}, MeasurementError, "above zero"),
    ],
)
def test_what_is_no_log_is_refused(changed, error, sentence):
    asked = {"times_s": [0.5, 1.0], "anchor_numbers": [0, 1], "measured_m": [900.0, 900.0], "variances_m2": 1.0}
    with pytest.raises(error, match=sentence):
        filter_ranges(belief(False), MOTION, **(asked | changed), anchors_m=ANCHORS_M)
