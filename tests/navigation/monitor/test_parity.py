"""Parity by QR: least squares by the definition, the stated rate of false alarms, faults found and named."""

import math

import numpy as np
import pytest
from scipy.stats import binom, chi2

from navigation import MeasurementError
from navigation.monitor import EpochVerdict, Use, chi_square_limit, judge_epochs, whiten
from tests.reference.parity import fewest_excluded, residual_statistic


def sky(rng, epochs, count, *, clock=True):
    """Rows of satellites above 10 degrees: (epochs, count, 3 or 4)."""
    up = rng.uniform(np.sin(np.radians(10.0)), 1.0, (epochs, count))
    azimuth = rng.uniform(0.0, 2.0 * np.pi, (epochs, count))
    flat = np.sqrt(1.0 - up**2)
    units = np.stack([flat * np.sin(azimuth), flat * np.cos(azimuth), up], axis=2)
    return np.concatenate([-units, np.ones((epochs, count, 1))], axis=2) if clock else -units


def made_up(rng, rows, sigma):
    """Measurements of a random state with normal noise."""
    state = rng.normal(0.0, 5.0, (len(rows), rows.shape[2]))
    return np.einsum("emn,en->em", rows, state) + rng.normal(0.0, sigma, rows.shape[:2]), state


def inside(events, trials, probability):
    """Whether a count lies in the binomial's central 99.9 %."""
    low, high = binom.interval(0.999, trials, probability)
    return low <= events <= high


@pytest.mark.parametrize("degrees", [1, 2, 3, 8, 21])
@pytest.mark.parametrize("rate", [0.05, 1e-3, 1e-7])
def test_limits_are_those_of_the_chi_square_distribution(degrees, rate):
    assert chi_square_limit(rate, degrees) == pytest.approx(chi2.isf(rate, degrees), rel=1e-9)


def test_statistic_and_solution_are_those_of_least_squares():
    rng = np.random.default_rng(1)
    rows = sky(rng, 20, 9)
    sigmas = rng.uniform(0.5, 3.0, (20, 9))
    measured, _ = made_up(rng, rows, 1.0)
    found = judge_epochs(rows, measured, sigmas, most_excluded=0)
    for e in range(20):
        statistic, solution = residual_statistic(rows[e], measured[e], sigmas[e])
        assert found.statistic[e] == pytest.approx(statistic, rel=1e-9)
        np.testing.assert_allclose(found.solution[e], solution, atol=1e-9)
    assert (found.degrees == 5).all()


def test_exclusion_is_the_search_over_every_set():
    rng = np.random.default_rng(2)
    rows = sky(rng, 60, 9)
    measured, _ = made_up(rng, rows, 1.0)
    for e in range(60):
        liars = rng.choice(9, e % 4, replace=False)
        measured[e, liars] += rng.uniform(6.0, 60.0, len(liars))
    found = judge_epochs(rows, measured, 1.0, false_alarm=1e-2)
    limits = [math.inf, *(chi2.isf(1e-2, d) for d in range(1, 9))]
    seen = set()
    for e in range(60):
        size, passing = fewest_excluded(rows[e], measured[e], np.ones(9), limits, 3)
        seen.add(found.verdict[e])
        if not passing:
            assert found.verdict[e] == EpochVerdict.UNEXPLAINED
            continue
        told = (
            EpochVerdict.CLEAR if size == 0 else EpochVerdict.EXPLAINED if len(passing) == 1 else EpochVerdict.AMBIGUOUS
        )
        assert found.verdict[e] == told
        statistic, best, solution = passing[0]
        assert tuple(np.flatnonzero(found.use[e] == Use.EXCLUDED)) == best
        assert found.remaining[e] == pytest.approx(statistic, rel=1e-7, abs=1e-7)
        np.testing.assert_allclose(found.solution[e], solution, atol=1e-6)
        others = sorted({i for _, chosen, _ in passing for i in chosen} - set(best))
        assert list(np.flatnonzero(found.use[e] == Use.SUSPECTED)) == others
    assert {EpochVerdict.CLEAR, EpochVerdict.EXPLAINED, EpochVerdict.AMBIGUOUS} <= seen


@pytest.mark.parametrize("clock", [True, False], ids=["phase differences", "ranges of drones"])
@pytest.mark.parametrize("rate", [0.05, 1e-3])
def test_right_measurements_are_alarmed_at_the_stated_rate(clock, rate):
    rng = np.random.default_rng(3)
    rows = sky(rng, 40_000, 8, clock=clock)
    sigmas = rng.uniform(0.002, 0.02, (40_000, 8))
    measured, _ = made_up(rng, rows, sigmas)
    found = judge_epochs(rows, measured, sigmas, false_alarm=rate, most_excluded=0)
    assert inside(found.alarm.sum(), 40_000, rate)


def test_each_element_passes_three_of_its_sigmas_as_often_as_normal_numbers_do():
    rng = np.random.default_rng(4)
    rows = sky(rng, 40_000, 8)
    measured, _ = made_up(rng, rows, 0.004)
    found = judge_epochs(rows, measured, 0.004, elements_sigma=3.0, most_excluded=0)
    assert inside(found.alarm.sum(), 40_000, 1.0 - math.erf(3.0 / math.sqrt(2.0)) ** 4)


def test_unequal_sigmas_are_taken_into_parity_space_element_by_element():
    rng = np.random.default_rng(5)
    # of one dimension, for a parity space of more has no base of its own, and the elements turn with the base
    rows, sigmas = sky(rng, 1, 5), np.array([[0.1, 0.2, 1.0, 0.5, 3.0]])
    measured, _ = made_up(rng, rows, sigmas)
    found = judge_epochs(rows, measured, sigmas, elements_sigma=3.0, most_excluded=0)
    q = np.linalg.qr(rows[0], mode="complete").Q[:, 4:].T
    expected = np.abs(q @ measured[0]) / np.sqrt((q**2 * sigmas[0] ** 2).sum(axis=1))
    assert found.worst_element[0] == pytest.approx(expected[0], rel=1e-9)


def test_a_slip_of_half_a_cycle_is_always_found_and_named():
    rng = np.random.default_rng(6)
    rows = sky(rng, 2_000, 9)
    measured, _ = made_up(rng, rows, 0.004)
    slipped = rng.integers(0, 9, 2_000)
    measured[np.arange(2_000), slipped] += 0.095
    found = judge_epochs(rows, measured, 0.004)
    # in some skies the position takes up nearly all of one satellite's error, and nobody can see it
    left = 1.0 - np.einsum("emn,enm->em", rows, np.linalg.pinv(rows))[np.arange(2_000), slipped]
    fair = left > 0.15
    assert fair.mean() > 0.8
    assert found.alarm[fair].all()
    named = found.use[np.arange(2_000), slipped] == Use.EXCLUDED
    assert named[fair].mean() > 0.99
    np.testing.assert_allclose(
        found.wrong_by[np.arange(2_000), slipped][fair & named], 0.095, atol=5 * 0.004 / 0.15**0.5
    )


def test_what_is_predicted_hidden_takes_no_part():
    rng = np.random.default_rng(7)
    rows = sky(rng, 3, 7)
    measured, _ = made_up(rng, rows, 0.1)
    measured[:, 2] += 500.0
    sigmas = np.full((3, 7), 0.1)
    sigmas[:, 2] = math.inf
    hidden = judge_epochs(rows, measured, sigmas)
    without = judge_epochs(np.delete(rows, 2, 1), np.delete(measured, 2, 1), 0.1)
    np.testing.assert_array_equal(hidden.statistic, without.statistic)
    assert (hidden.use[:, 2] == Use.LEFT_OUT).all()


def test_without_redundancy_or_geometry_nothing_is_judged():
    rows = sky(np.random.default_rng(8), 2, 5)
    rows[1, :, :3] = rows[1, 0, :3]
    measured = np.full((2, 5), 9.0)
    measured[0, 4] = math.nan
    found = judge_epochs(rows, measured, 1.0)
    assert list(found.verdict) == [EpochVerdict.UNTESTABLE, EpochVerdict.UNTESTABLE]
    assert np.isfinite(found.solution[0]).all()
    assert np.isnan(found.solution[1]).all()


def test_noise_that_is_shared_is_whitened():
    rng = np.random.default_rng(9)
    rows = sky(rng, 1, 7)[0]
    root = rng.normal(size=(7, 7)) + 3.0 * np.eye(7)
    covariance, measured = root @ root.T, rng.normal(size=7)
    white_rows, white = whiten(rows, measured, covariance)
    found = judge_epochs(white_rows[None], white[None], 1.0)
    inverse = np.linalg.inv(covariance)
    solution = np.linalg.solve(rows.T @ inverse @ rows, rows.T @ inverse @ measured)
    rest = measured - rows @ solution
    assert found.statistic[0] == pytest.approx(rest @ inverse @ rest, rel=1e-9)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"sigmas": 0.0}, "above zero"),
        ({"sigmas": np.ones(3)}, "sigmas must be"),
        ({"measured": np.full((1, 6), np.inf)}, "finite"),
        ({"measured": np.zeros(6)}, "epochs, measurements"),
        ({"rows": np.zeros((1, 5, 4))}, "rows must be"),
        ({"most_excluded": 7}, "most_excluded"),
        ({"false_alarm": 0.0}, "false alarms"),
        ({"elements_sigma": -1.0}, "elements_sigma"),
    ],
)
def test_what_makes_no_epoch_is_refused(change, sentence):
    asked = {"rows": np.zeros((1, 6, 4)), "measured": np.zeros((1, 6)), "sigmas": 1.0, **change}
    with pytest.raises(MeasurementError, match=sentence):
        judge_epochs(asked.pop("rows"), asked.pop("measured"), asked.pop("sigmas"), **asked)
