"""Hypotheses about ranges that lie: beside a posterior that is drawn, on drives that lie, and what is refused."""

import numpy as np
import pytest

from navigation import (
    MeasurementError,
    MotionNoise,
    OcclusionModel,
    StateError,
    TimeOrderError,
    bubble_radius_m,
    carry_hypotheses,
    initial_state,
    predict,
    update_hypotheses,
    update_ranges,
)
from tests.navigation.worlds import ANCHORS_M
from tests.reference.lying_ranges import posterior

QUIET = MotionNoise(1e-9, 1e-9, 1e-9)
PLACE_M = np.array([40.0, -30.0, 20.0])
ONE = OcclusionModel((0.2,), (0.0,))


@pytest.mark.parametrize("excess_m", [(0.0,) * 6, (9.0, 0.0, 0.0, 0.0, 0.0, 0.0), (3.0, 0.0, 6.0, 0.0, 0.0, 2.0)])
def test_one_epoch_is_believed_as_a_posterior_that_is_drawn(excess_m):
    rng = np.random.default_rng(3)
    measured = np.linalg.norm(ANCHORS_M - PLACE_M, axis=1) + rng.normal(0.0, 1.0, 6) + excess_m
    start = initial_state(0.0, PLACE_M + np.array([2.0, -1.0, 3.0]), position_sigma_m=4.0, velocity_sigma_m_per_s=1e-6)
    found = update_hypotheses(carry_hypotheses(start, 6, ONE), 0.0, QUIET, ANCHORS_M, measured, 1.0, model=ONE)
    prior = start.position_m, 16.0 * np.eye(3)
    mean, covariance, lies = posterior(rng, 400_000, prior, ANCHORS_M, measured, 1.0, 0.2, (1.0, 4.0))
    state = found.state()
    np.testing.assert_allclose(found.occluded, lies, atol=0.05)
    np.testing.assert_allclose(state.position_m, mean, atol=0.25)
    np.testing.assert_allclose(state.position_covariance_m2, covariance, atol=0.15 * np.trace(covariance))


def test_where_nothing_lies_it_is_nearly_the_plain_filter():
    rng = np.random.default_rng(1)
    motion, place_m, velocity = MotionNoise(), PLACE_M.copy(), np.array([1.0, 2.0, 0.0])
    plain = initial_state(0.0, place_m, position_sigma_m=5.0)
    belief = carry_hypotheses(plain, 6)
    for second in range(1, 41):
        place_m = place_m + velocity
        measured = np.linalg.norm(ANCHORS_M - place_m, axis=1) + rng.normal(0.0, 1.0, 6)
        plain = update_ranges(predict(plain, second, motion), ANCHORS_M, measured, 1.0).state
        belief = update_hypotheses(belief, second, motion, ANCHORS_M, measured, 1.0)
    radius = [float(bubble_radius_m(one.position_covariance_m2)) for one in (plain, belief.state())]
    assert radius[1] < 1.25 * radius[0]
    assert np.linalg.norm(belief.state().position_m - plain.position_m) < 1.0
    assert belief.occluded.max() < 0.3
    assert belief.probabilities.sum() == pytest.approx(1.0)


def flown(seed, lasting_s):
    """(share of epochs within the bubble, radius) of the hypotheses and of a gated filter; a fifth of ranges lies."""
    rng = np.random.default_rng(seed)
    motion, place_m, velocity = MotionNoise(), PLACE_M.copy(), rng.normal(0.0, 2.0, 3)
    gated = initial_state(0.0, place_m + rng.normal(0.0, 3.0, 3), position_sigma_m=3.0, velocity_sigma_m_per_s=3.0)
    belief, anchors = carry_hypotheses(gated, 5), ANCHORS_M[:5]
    lying, excess_m = rng.random(5) < 0.2, 1.0 + rng.exponential(4.0, 5)
    held = []
    for second in range(1, 91):
        pushed = rng.normal(0.0, np.sqrt(0.1), 3)
        place_m, velocity = place_m + velocity + pushed / 2.0, velocity + pushed
        anew = rng.random(5) < (1.0 / lasting_s if lasting_s else 1.0)
        lying = np.where(anew, rng.random(5) < 0.2, lying)
        excess_m = np.where(anew, 1.0 + rng.exponential(4.0, 5), excess_m)
        measured = np.linalg.norm(anchors - place_m, axis=1) + rng.normal(0.0, 1.0, 5) + lying * excess_m
        gated = update_ranges(predict(gated, second, motion), anchors, measured, 1.0, gate_sigma=3.0).state
        belief = update_hypotheses(belief, second, motion, anchors, measured, 1.0)
        for state in (belief.state(), gated):
            radius_m = float(bubble_radius_m(state.position_covariance_m2))
            held.append((np.linalg.norm(state.position_m - place_m) <= radius_m, radius_m))
    table = np.array(held).reshape(-1, 2, 2)
    return table[..., 0].mean(axis=0), np.median(table[..., 1], axis=0)


@pytest.mark.parametrize(("lasting_s", "least"), [(0.0, 0.96), (15.0, 0.92)])
def test_the_bubble_holds_though_a_fifth_of_the_ranges_lies(lasting_s, least):
    held, radius_m = np.array([flown(seed, lasting_s) for seed in range(8)]).mean(axis=0)
    assert held[0] >= least
    assert held[0] > held[1] + (0.05 if lasting_s else 0.0)
    assert radius_m[0] < 3.0 * radius_m[1]


def test_what_the_map_hides_is_taken_for_a_lie():
    measured = np.linalg.norm(ANCHORS_M - PLACE_M, axis=1)
    start = initial_state(0.0, PLACE_M, position_sigma_m=4.0)
    begun = carry_hypotheses(start, 6, ONE)
    sight = np.array([0.001, 1.0, 1.0, 1.0, 1.0, 1.0])
    open_sky, hidden = (
        update_hypotheses(begun, 0.0, QUIET, ANCHORS_M, measured + 1.5, 1.0, sight=one, model=ONE)
        for one in (1.0, sight)
    )
    assert hidden.occluded[0] > max(0.9, open_sky.occluded[0])


def test_both_sides_of_a_coplanar_set_are_carried_until_something_decides():
    level = ANCHORS_M[:5] * (1.0, 1.0, 0.0) + (0.0, 0.0, 300.0)
    sides = [initial_state(0.0, PLACE_M * (1, 1, 0) + (0, 0, up), position_sigma_m=2.0) for up in (20.0, 580.0)]
    measured = np.linalg.norm(level - sides[0].position_m, axis=1)
    belief = update_hypotheses(carry_hypotheses(sides, 5), 1.0, MotionNoise(), level, measured, 1.0)
    assert np.sqrt(belief.state().position_covariance_m2[2, 2]) == pytest.approx(280.0, rel=0.1)
    apart = np.vstack([level, (100.0, 100.0, 0.0)])
    measured = np.linalg.norm(apart - sides[0].position_m, axis=1)
    belief = update_hypotheses(carry_hypotheses(sides, 6), 1.0, MotionNoise(), apart, measured, 1.0)
    assert belief.state().position_m[2] == pytest.approx(20.0, abs=3.0)


def test_what_is_no_question_is_refused():
    start = initial_state(0.0, PLACE_M)
    belief = carry_hypotheses(start, 6)
    ranges = np.full(6, 500.0)
    with pytest.raises(TimeOrderError):
        update_hypotheses(belief, -1.0, QUIET, ANCHORS_M, ranges, 1.0)
    with pytest.raises(MeasurementError, match="is about 6 anchors, not 5"):
        update_hypotheses(belief, 1.0, QUIET, ANCHORS_M[:5], ranges[:5], 1.0)
    with pytest.raises(MeasurementError, match="it has more regimes"):
        update_hypotheses(belief, 1.0, QUIET, ANCHORS_M, ranges, 1.0, model=ONE)
    with pytest.raises(MeasurementError, match="variances_m2 above zero"):
        update_hypotheses(belief, 1.0, QUIET, ANCHORS_M, ranges, 0.0)
    with pytest.raises(StateError, match="without a clock"):
        carry_hypotheses(initial_state(0.0, PLACE_M, clock_m=(0.0, 0.0)), 6)
    with pytest.raises(StateError, match="1 to 16 anchors"):
        carry_hypotheses(start, 0)
    with pytest.raises(MeasurementError, match="between 0 and 1"):
        OcclusionModel((0.0,), (0.0,))
    with pytest.raises(MeasurementError, match="as many of the one"):
        OcclusionModel((0.1, 0.2), (0.0,))
