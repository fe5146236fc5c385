"""A gate that keeps out nearly everything guards a wrong belief: the filter notices, says so and finds back."""

from __future__ import annotations

import numpy as np
import pytest

from navigation import Verdict, filter_ranges, initial_state, predict, update_fix, update_ranges
from tests.navigation.worlds import ANCHORS_M, MOTION

GATE = 4.0
OFF_M = 60.0


def log(count: int, seed: int, bad_share: float = 0.0):
    """Single ranges of a rover that goes 2 m/s, ten a second, some far too long."""
    rng = np.random.default_rng(seed)
    times_s = 0.1 * np.arange(1, count + 1)
    which = rng.integers(0, len(ANCHORS_M), count)
    places_m = np.column_stack([2.0 * times_s, -1.0 * times_s, np.full(count, 20.0)])
    ranges_m = np.linalg.norm(places_m - ANCHORS_M[which], axis=1) + 0.3 * rng.normal(size=count)
    ranges_m += np.where(rng.random(count) < bad_share, rng.uniform(10.0, 200.0, count), 0.0)
    return times_s, which, ranges_m, places_m


def sure_of(place_m):
    return initial_state(0.0, place_m, (2.0, -1.0, 0.0), position_sigma_m=0.5, velocity_sigma_m_per_s=0.3)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("off_m", [(OFF_M, 0.0, 0.0), (0.0, -OFF_M, 10.0), (-300.0, 200.0, 0.0)])
def test_a_filter_that_began_at_a_wrong_place_and_is_sure_of_it_finds_back_and_says_when(seed, off_m):
    times_s, which, ranges_m, places_m = log(600, seed, bad_share=0.2)
    found = filter_ranges(
        sure_of(np.add((0.0, 0.0, 20.0), off_m)), MOTION, times_s, which, ranges_m, 0.09, ANCHORS_M, gate_sigma=GATE
    )
    error_m = np.linalg.norm(found.position_m - places_m, axis=1)
    assert (found.verdict == Verdict.REACQUIRED).any()
    assert np.sqrt(np.mean(error_m[300:] ** 2)) < 1.5
    first = int(np.argmax(found.verdict == Verdict.REACQUIRED))
    assert np.trace(found.position_covariance_m2[first]) > 2.0 * np.trace(found.position_covariance_m2[first - 1])


def test_ranges_that_are_often_too_long_do_not_make_a_good_filter_lost():
    times_s, which, ranges_m, places_m = log(3000, 1, bad_share=0.4)
    found = filter_ranges(sure_of((0.0, 0.0, 20.0)), MOTION, times_s, which, ranges_m, 0.09, ANCHORS_M, gate_sigma=GATE)
    assert not (found.verdict == Verdict.REACQUIRED).any()
    assert np.linalg.norm(found.position_m - places_m, axis=1).max() < 2.0


def test_ranges_of_one_instant_find_back_as_well():
    state = sure_of((OFF_M, 0.0, 20.0))
    said = False
    for second in range(1, 30):
        place_m = np.array([2.0 * second, -1.0 * second, 20.0])
        update = update_ranges(
            predict(state, float(second), MOTION), ANCHORS_M, np.linalg.norm(ANCHORS_M - place_m, axis=1), 0.09,
            gate_sigma=GATE,
        )  # fmt: skip
        state, said = update.state, said or update.reacquired
    assert said
    assert np.linalg.norm(state.position_m - place_m) < 0.5


def test_fixes_that_are_all_refused_are_believed_in_the_end():
    state = sure_of((OFF_M, 0.0, 20.0))
    said = []
    for second in range(1, 20):
        place_m = np.array([2.0 * second, -1.0 * second, 20.0])
        update = update_fix(predict(state, float(second), MOTION), place_m, np.eye(3), gate_sigma=GATE)
        state = update.state
        said.append(update.reacquired)
    assert said.count(True) == 1
    assert said.index(True) == 3
    assert np.linalg.norm(state.position_m - place_m) < 1.0
