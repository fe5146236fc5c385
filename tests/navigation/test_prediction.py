"""Bubbles along a path before it is driven."""

import math

import numpy as np
import pytest

from navigation import (
    BubbleError,
    MeasurementError,
    MotionNoise,
    StateError,
    TimeOrderError,
    bubble_radius_m,
    initial_state,
    predict,
    predict_bubble,
    update_ranges,
)
from tests.navigation.worlds import ANCHORS_M, MOTION, true_ranges_m

COUNT = len(ANCHORS_M)


def path(points=40, speed=3.0):
    along = np.arange(points, dtype=float)
    return np.column_stack([speed * along, 0.5 * along, 20.0 + 0.1 * along]), along


def sight(points=40, seed=5):
    return np.random.default_rng(seed).random((points, COUNT)) < 0.7


@pytest.mark.parametrize("clock", [False, True], ids=["ranging", "pseudoranges"])
def test_it_is_the_covariance_that_the_filter_will_have(clock):
    points_m, times_s = path()
    visible = sight()
    predicted = predict_bubble(points_m, times_s, ANCHORS_M, visible, 0.4, motion=MOTION, clock=clock)
    for point, time_s, seen, covariance in zip(
        points_m, times_s, visible, predicted.position_covariance_m2, strict=True
    ):
        if time_s == 0.0:
            state = initial_state(0.0, point, clock_m=(0.0, 0.0) if clock else None)
        else:
            state = predict(state, time_s, MOTION)
        at_point = state.mean.copy()
        at_point[[0, 2, 4]] = point  # the filter that is where it thinks it is
        state = type(state)(time_s, at_point, state.covariance)
        state = update_ranges(state, ANCHORS_M[seen], true_ranges_m(point, ANCHORS_M[seen]), 0.16).state
        np.testing.assert_allclose(covariance, state.position_covariance_m2, rtol=1e-9, atol=1e-12)


def test_ranges_between_points_come_at_their_own_rate():
    points_m, times_s = path()
    all_seen = np.ones((40, COUNT), bool)
    fine = predict_bubble(points_m, times_s, ANCHORS_M, all_seen, 0.4, motion=MOTION)
    coarse = [0, 13, 39]
    few = predict_bubble(
        points_m[coarse], times_s[coarse], ANCHORS_M, all_seen[coarse], 0.4, motion=MOTION, interval_s=1.0
    )
    np.testing.assert_allclose(few.radius_m, fine.radius_m[coarse], rtol=1e-9)


def test_out_of_sight_of_all_anchors_the_bubble_grows_and_shrinks_again():
    points_m, times_s = path()
    visible = np.ones((40, COUNT), bool)
    visible[10:30] = False
    radius_m = predict_bubble(points_m, times_s, ANCHORS_M, visible, 0.4, motion=MOTION).radius_m
    assert (np.diff(radius_m[9:30]) > 0.0).all()
    assert radius_m[30] < radius_m[29] / 3.0


def test_one_anchor_more_never_makes_the_bubble_larger():
    points_m, times_s = path()
    visible = sight()
    more = visible.copy()
    more[:, 0] = True
    less_m = predict_bubble(points_m, times_s, ANCHORS_M, visible, 0.4, motion=MOTION).radius_m
    more_m = predict_bubble(points_m, times_s, ANCHORS_M, more, 0.4, motion=MOTION).radius_m
    assert (more_m <= less_m + 1e-9).all()


def test_a_rover_that_knows_its_ground_has_a_smaller_bubble():
    points_m, times_s = path()
    visible = np.ones((40, COUNT), bool)
    visible[:, 3:] = False
    free = predict_bubble(points_m, times_s, ANCHORS_M, visible, 0.4, motion=MOTION)
    bound = predict_bubble(
        points_m, times_s, ANCHORS_M, visible, 0.4, motion=MOTION, ground_slope=np.zeros((40, 2)), ground_sigma_m=0.1
    )
    assert (bound.radius_m < free.radius_m).all()
    assert (bound.position_covariance_m2[:, 2, 2] <= 0.01).all()


def test_the_dilution_scales_the_variance_as_eq_26_says():
    points_m, times_s = path()
    visible = np.ones((40, COUNT), bool)
    scaled = predict_bubble(points_m, times_s, ANCHORS_M, visible, 0.4, motion=MOTION, dop=np.full(40, 4.0))
    same = predict_bubble(points_m, times_s, ANCHORS_M, visible, 0.8, motion=MOTION)
    np.testing.assert_allclose(scaled.radius_m, same.radius_m)


def test_the_radius_is_epsilon_times_the_root_of_the_trace_plus_the_dems_sigma():
    covariance = np.diag([4.0, 3.0, 2.0])
    assert bubble_radius_m(covariance, 3.0, dem_sigma_m=1.5) == pytest.approx(3.0 * 3.0 + 1.5)
    predicted = predict_bubble(
        [(0.0, 0.0, 0.0)], [0.0], ANCHORS_M, np.ones((1, COUNT)), 0.4, epsilon=2.0, dem_sigma_m=1.0
    )
    assert predicted.radius_m[0] == pytest.approx(2.0 * math.sqrt(predicted.trace_m2[0]) + 1.0)


def test_no_points_make_no_bubble():
    assert predict_bubble(np.empty((0, 3)), [], ANCHORS_M, np.empty((0, COUNT)), 0.4).radius_m.shape == (0,)


@pytest.mark.parametrize(
    ("changed", "error", "sentence"),
    [
        ({"times_s": [0.0, 2.0, 1.0]}, TimeOrderError, "1 s follows 2 s at point 2"),
        ({"times_s": [0.0, math.nan, 1.0]}, BubbleError, "times_s must hold finite"),
        ({"points_m": [(0.0, 0.0)] * 3}, BubbleError, "points_m"),
        ({"visible": np.ones((3, 2))}, BubbleError, "visible must tell"),
        ({"epsilon": 0.0}, BubbleError, "epsilon must be above zero"),
        ({"epsilon": -1.0}, BubbleError, "epsilon must be above zero"),
        ({"dem_sigma_m": -1.0}, BubbleError, "dem_sigma_m"),
        ({"interval_s": 0.0}, BubbleError, "interval_s must be above zero"),
        ({"interval_s": 1e-9}, BubbleError, "intervals"),
        ({"range_sigma_m": [0.4, 0.4, math.nan, 0.4, 0.4, 0.4]}, MeasurementError, "number 2 .* needs a mu_m2"),
        ({"range_sigma_m": [0.4, 0.4]}, MeasurementError, "one number for each"),
        ({"dop": 0.0}, MeasurementError, "dop must be above zero"),
        ({"weights": 1.5}, MeasurementError, "weights must lie"),
        ({"initial_covariance": -np.eye(6)}, StateError, "not positive"),
        ({"initial_covariance": np.eye(8)}, BubbleError, "initial_covariance must have shape"),
        ({"ground_slope": np.full((3, 2), np.nan)}, BubbleError, "ground_slope"),
    ],
)
def test_what_cannot_be_predicted_is_refused(changed, error, sentence):
    points_m, times_s = path(3)
    asked = {"points_m": points_m, "times_s": times_s, "anchors_m": ANCHORS_M, "visible": np.ones((3, COUNT), bool)}
    asked |= {"range_sigma_m": 0.4, "motion": MotionNoise()} | changed
    with pytest.raises(error, match=sentence):
        predict_bubble(**asked)


def test_a_covariance_of_the_wrong_shape_has_no_radius():
    with pytest.raises(BubbleError, match="must be"):
        bubble_radius_m(np.eye(2))
    with pytest.raises(BubbleError, match="negative trace"):
        bubble_radius_m(-np.eye(3))
