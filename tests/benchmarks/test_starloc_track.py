"""Real UWB ranges through the filter: what the detector says of them makes it better and its bubble truer."""

import numpy as np
import pytest

import navigation
from benchmarks.detection.measured_ranges import starloc, starloc_sequences
from benchmarks.navigation.starloc_drive import ranges_dropped
from benchmarks.navigation.starloc_track import detector_weights, starloc_track
from navigation.estimators import SLOW

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


@pytest.fixture(scope="module")
def second():
    """(sequence, its logs, the detector's weights) of the sequence whose anchors and tags lie nearly in a plane."""
    sequence = starloc_sequences()[-1]
    logs = starloc(sequence)
    return sequence, logs, [detector_weights(log) for log in logs]


def test_a_filter_that_is_told_of_errors_that_stay_holds_the_tags_without_larger_errors(second):
    _, logs, weights = second
    found = {}
    for slow in (1.0, SLOW):
        tracks = [starloc_track(log, one, slow=slow) for log, one in zip(logs, weights, strict=True)]
        off_m = np.concatenate([track.distance_m for track in tracks])
        radius_m = navigation.bubble_radius_m(np.concatenate([track.covariance_m2 for track in tracks]))
        found[slow] = float(np.sqrt(np.mean(off_m**2))), float(np.mean(off_m <= radius_m))
    assert found[SLOW][1] >= 0.97 > found[1.0][1]
    assert found[SLOW][0] <= found[1.0][0]


def test_readings_carry_the_rig_through_five_seconds_without_ranges():
    ratios = [float(row.cells[3]) for row in ranges_dropped((26.0,)).rows]
    assert len(ratios) == len(starloc_sequences())
    assert max(ratios) <= 0.5
