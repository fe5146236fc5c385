"""What a bubble promises, and whether it keeps clear of the ground."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from navigation import (
    BubbleError,
    BubbleVerdict,
    bubble_confidence,
    bubble_radius_m,
    check_bubbles,
    radius_of_confidence,
)

AXES = {1: (4.0, 0.0, 0.0), 2: (4.0, 4.0, 0.0), 3: (4.0, 4.0, 4.0)}


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("epsilon", [1.0, 2.0, 3.0])
def test_with_equal_sigmas_the_promise_is_the_chi_distributions(axes, epsilon):
    covariance = np.diag(AXES[axes])
    promised = bubble_confidence(covariance, bubble_radius_m(covariance, epsilon))
    assert promised == pytest.approx(chi2.cdf(axes * epsilon**2, axes), abs=1e-7)


@pytest.mark.parametrize("sigmas", [(3.0, 1.0, 0.2), (10.0, 9.0, 0.01), (100.0, 1.0, 1.0)])
def test_with_any_sigmas_it_is_the_share_of_drawn_errors(sigmas):
    rng = np.random.default_rng(2)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    covariance = turn @ np.diag(np.square(sigmas)) @ turn.T
    lengths = np.linalg.norm(rng.multivariate_normal(np.zeros(3), covariance, 100_000), axis=1)
    for radius_m in np.quantile(lengths, [0.1, 0.5, 0.9, 0.99]):
        share = float(np.mean(lengths <= radius_m))
        four_sigmas = 4.0 * math.sqrt(share * (1.0 - share) / len(lengths))
        assert float(bubble_confidence(covariance, radius_m)) == pytest.approx(share, abs=four_sigmas)


def test_the_radius_of_a_confidence_has_that_confidence():
    rng = np.random.default_rng(6)
    roots = rng.normal(size=(50, 3, 3)) * rng.uniform(0.01, 30.0, (50, 1, 3))
    covariances = roots @ roots.transpose(0, 2, 1)
    for confidence in (0.05, 0.683, 0.97, 0.9999):
        radii = radius_of_confidence(covariances, confidence)
        np.testing.assert_allclose(bubble_confidence(covariances, radii), confidence, atol=1e-7)


def test_unknown_covariances_promise_nothing_and_certain_ones_everything():
    assert math.isnan(bubble_confidence(np.full((3, 3), np.nan), 5.0))
    assert math.isnan(radius_of_confidence(np.full((3, 3), np.nan), 0.9))
    assert bubble_confidence(np.zeros((3, 3)), 1e-6) == 1.0


POINTS_M = np.array([(0.0, 0.0, 10.0), (5.0, 0.0, 3.0), (9.0, 0.0, 6.0)])
NEAREST_M = np.array([(0.0, 0.0, 0.0), (5.0, 0.0, 0.0), (9.0, 8.0, 6.0)])


def test_the_bubble_may_touch_the_surface_and_no_more():
    check = check_bubbles(POINTS_M, [10.0, 4.0, 8.0], [10.0, 3.0, 8.0], NEAREST_M)
    assert check.verdict.tolist() == [BubbleVerdict.OK, BubbleVerdict.VIOLATED, BubbleVerdict.OK]
    assert check.margin_m == pytest.approx([0.0, -1.0, 0.0])
    assert check.first_violation == 1
    assert check.count(BubbleVerdict.OK) == 2


def test_the_push_leads_away_from_the_nearest_place_by_what_is_missing():
    check = check_bubbles(POINTS_M, [4.0, 4.0, 9.0], [10.0, 3.0, 8.0], NEAREST_M)
    np.testing.assert_allclose(check.push, [(0.0, 0.0, 1.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)])
    assert check.push_m == pytest.approx([0.0, 1.0, 1.0])


def test_unknown_ground_within_the_radius_makes_it_unknown_unless_it_is_violated_anyway():
    check = check_bubbles(POINTS_M, [4.0, 4.0, 4.0], [10.0, 3.0, 8.0], NEAREST_M, [3.0, 3.0, 5.0])
    assert check.verdict.tolist() == [BubbleVerdict.UNKNOWN, BubbleVerdict.VIOLATED, BubbleVerdict.OK]


def test_an_estimate_under_the_ground_is_pushed_up_through_it_where_that_is_allowed():
    with pytest.raises(BubbleError, match=r"Point 1 lies 2.00 m under the ground") as refused:
        check_bubbles(POINTS_M[:2] - (0.0, 0.0, 5.0), [1.0, 1.0], [5.0, -2.0], NEAREST_M[:2])
    assert refused.value.index == 1
    check = check_bubbles([(5.0, 0.0, -2.0)], [1.0], [-2.0], NEAREST_M[1:2], under_ground="violated")
    np.testing.assert_allclose(check.push, [(0.0, 0.0, 1.0)])
    assert check.push_m == pytest.approx([3.0])


def test_on_the_surface_itself_the_push_is_up():
    check = check_bubbles([(5.0, 0.0, 0.0)], [1.0], [0.0], [(5.0, 0.0, 0.0)])
    np.testing.assert_allclose(check.push, [(0.0, 0.0, 1.0)])


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: check_bubbles(POINTS_M, [1.0] * 3, [1.0, math.nan, 1.0], NEAREST_M), "Point 1 has no clearance"),
        (lambda: check_bubbles(POINTS_M, [1.0, 1.0, math.nan], [1.0] * 3, NEAREST_M), "Point 2 has a radius of nan"),
        (lambda: check_bubbles(POINTS_M, [1.0, -1.0, 1.0], [1.0] * 3, NEAREST_M), "Point 1 has a radius of -1"),
        (lambda: bubble_radius_m(np.eye(3), 0.0), "epsilon must be above zero, not 0"),
        (lambda: bubble_radius_m(np.eye(3), math.nan), "epsilon must be above zero"),
        (lambda: radius_of_confidence(np.eye(3), 1.0), "confidence must lie between"),
        (lambda: radius_of_confidence(np.eye(2), 0.9), "must be"),
        (lambda: bubble_confidence(np.diag([1.0, 1.0, -1.0]), 1.0), "not positive"),
    ],
)
def test_a_bubble_that_cannot_be_is_refused(ask, sentence):
    with pytest.raises(BubbleError, match=sentence):
        ask()
