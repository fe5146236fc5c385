"""Real UWB ranges through the filter: what the detector says of them makes it better and its bubble truer."""

import numpy as np
import pytest

import navigation
from benchmarks.detection.measured_ranges import starloc, starloc_sequences
from benchmarks.navigation.starloc_track import detector_weights, starloc_track

pytestmark = pytest.mark.skipif(not starloc_sequences(), reason="needs ../shared/data")


@pytest.fixture(scope="module")
def log():
    return starloc(starloc_sequences()[0])[0].first(250)


def test_weights_are_one_for_each_range_and_leave_the_worst_out(log):
    weights = detector_weights(log)
    errors_m = np.concatenate(log.errors_m)
    assert weights.shape == errors_m.shape
    assert ((weights >= 0.0) & (weights <= 1.0)).all()
    assert np.mean(weights[np.abs(errors_m) > 1.0] == 0.0) > 0.9
    assert np.mean(weights[np.abs(errors_m) < 0.2] == 0.0) < 0.1


def test_the_detector_makes_the_filter_better_and_its_bubble_truer(log):
    off, on = starloc_track(log), starloc_track(log, detector_weights(log))
    holds = [np.mean(t.distance_m <= navigation.bubble_radius_m(t.covariance_m2)) for t in (off, on)]
    assert np.mean(on.distance_m**2) < np.mean(off.distance_m**2)
    assert holds[1] > holds[0]
    assert on.used_share < off.used_share == 1.0
