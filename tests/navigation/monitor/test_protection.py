"""Protection levels: closed forms without faults, and what a monitor misses when faults are as bad as can be."""

import math

import numpy as np
import pytest
from scipy.stats import norm

from navigation import MeasurementError
from navigation.monitor import ProtectionRisk, predict_protection, protection_levels
from tests.navigation.worlds import ANCHORS_M


def rows_of(place_m):
    away = np.asarray(place_m) - ANCHORS_M
    return away / np.linalg.norm(away, axis=1, keepdims=True)


def test_without_faults_a_level_is_a_quantile_of_the_position():
    rows = rows_of((0.0, 0.0, 20.0))
    risk = ProtectionRisk(missed=1e-4, unwatched=0.0)
    found = protection_levels(rows[None], 0.7, 0.0, risk)
    sigma = 0.7 * np.sqrt(np.diag(np.linalg.inv(rows.T @ rows)))
    shares = np.array([0.25, 0.25, 0.5]) * 1e-4
    np.testing.assert_allclose(found.axes_m[0], sigma * norm.isf(shares / 2.0), rtol=1e-6)
    assert found.unwatched[0] == 0.0


def test_a_single_suspect_is_bounded_by_the_separation_of_its_solution():
    rows = rows_of((30.0, -10.0, 5.0))
    faults = np.array([0.0, 0.0, 0.02, 0.0, 0.0, 0.0])
    risk = ProtectionRisk(missed=1e-3, false_alarm=1e-2, unwatched=0.0, most_faults=1)
    found = protection_levels(rows[None], 0.5, faults, risk)
    whole = 0.25 * np.linalg.inv(rows.T @ rows)
    rest = np.delete(rows, 2, 0)
    without = 0.25 * np.linalg.inv(rest.T @ rest)
    alarm = norm.isf(1e-2 / 6.0)
    level = found.axes_m[0, 0]
    risked = 2.0 * 0.98 * norm.sf(level / math.sqrt(whole[0, 0]))
    risked += 0.02 * norm.sf((level - alarm * math.sqrt(without[0, 0] - whole[0, 0])) / math.sqrt(without[0, 0]))
    assert risked == pytest.approx(0.25e-3, rel=1e-5)


def test_the_worst_fault_passes_unnoticed_beyond_a_level_no_more_often_than_allowed():
    rng = np.random.default_rng(0)
    rows = rows_of((100.0, 50.0, 0.0))
    fault, missed, alarm_rate = 0.2, 0.02, 0.05
    risk = ProtectionRisk(missed=missed, false_alarm=alarm_rate, unwatched=0.0, most_faults=1)
    faults = np.array([fault, 0.0, 0.0, 0.0, 0.0, 0.0])
    levels = protection_levels(rows[None], 1.0, faults, risk).axes_m[0]
    everything, rest = np.linalg.pinv(rows), np.linalg.pinv(rows[1:])
    apart = np.sqrt(np.diag(rest @ rest.T) - np.diag(everything @ everything.T))
    worst = 0.0
    for bias in np.linspace(0.0, 30.0, 40):
        noise = rng.normal(size=(40_000, 6))
        noise[rng.random(40_000) < fault, 0] += bias
        position, without = noise @ everything.T, noise[:, 1:] @ rest.T
        alarm = (np.abs(without - position) > norm.isf(alarm_rate / 6.0) * apart).any(axis=1)
        worst = max(worst, ((np.abs(position) > levels).any(axis=1) & ~alarm).mean())
    assert 0.0 < worst < missed


def test_more_doubt_and_less_sight_promise_less():
    points = np.zeros((3, 3))
    sight = np.array([[1.0] * 6, [0.99] * 6, [0.99] * 4 + [0.1] * 2])
    found = predict_protection(points, ANCHORS_M, sight, 0.5)
    assert found.horizontal_m[0] < found.horizontal_m[1]
    assert found.vertical_m[0] < found.vertical_m[1]
    assert np.isinf(found.horizontal_m[2]), "one of four ranges may be wrong, and three are no test of one another"
    bound = predict_protection(points, ANCHORS_M, sight, 0.5, height_sigma_m=1.0)
    assert np.isfinite(bound.horizontal_m[2]), "with the height of the map there is a redundant measurement"


def test_where_too_few_are_in_sight_nothing_is_promised():
    sight = np.zeros((1, 6))
    sight[0, :2] = 1.0
    assert np.isinf(predict_protection(np.zeros((1, 3)), ANCHORS_M, sight, 0.5).axes_m).all()


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"sight": 1.5}, "sight"),
        ({"fault": 1.0}, "fault"),
        ({"range_sigma_m": 0.0}, "sigmas"),
        ({"height_sigma_m": 0.0}, "height_sigma_m"),
    ],
)
def test_what_makes_no_question_is_refused(change, sentence):
    asked = {"sight": 1.0, "range_sigma_m": 0.5, **change}
    with pytest.raises(MeasurementError, match=sentence):
        predict_protection(np.zeros((1, 3)), ANCHORS_M, asked.pop("sight"), asked.pop("range_sigma_m"), **asked)
