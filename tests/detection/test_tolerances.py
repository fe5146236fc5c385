"""From uncertainties to tolerances, and whether tolerances of k sigma are exceeded as often as they promise."""

from __future__ import annotations

import math

import numpy as np
import pytest

from detection import (
    DetectionInputError,
    Detector,
    DetectorSettings,
    OdometryIncrement,
    false_positive_rate,
    k_for_false_positive_rate,
    sigma_geometric_m,
    sigma_odometry_m,
)
from detection.kernels import misfits, subsets
from detection.subset_search import Ranges, Rules
from tests.detection.worlds import DRONES_M, ROVER_M, Floats, drones, heard, true_ranges

# Seed 000, "Statistical Detection Thresholds"
PROMISED = pytest.mark.parametrize(("k", "rate"), [(2.0, 0.05), (3.0, 0.003), (4.0, 0.00006)])
STANDARD_DEVIATIONS = 4.5  # of a count of exceedances that chance explains


def agrees(count: int, of: int, rate: float) -> bool:
    expected = of * rate
    return abs(count - expected) <= STANDARD_DEVIATIONS * math.sqrt(expected) + 1.0


@PROMISED
def test_rates_and_sigmas_are_those_of_the_specification_both_ways(k: float, rate: float) -> None:
    assert false_positive_rate(k) == pytest.approx(rate, rel=0.12)  # it rounds
    assert k_for_false_positive_rate(false_positive_rate(k)) == pytest.approx(k)


def test_uncertainties_add_in_squares() -> None:
    assert sigma_geometric_m(0.3, 0.4) == pytest.approx(0.5)
    assert sigma_geometric_m(2.0, 3.0, 6.0) == pytest.approx(7.0)
    assert sigma_geometric_m(0.3, speed_m_per_s=4.0, time_sigma_s=0.1) == pytest.approx(0.5)
    assert sigma_odometry_m(2.0, 3.0) == pytest.approx(math.sqrt(13.0))
    assert sigma_odometry_m(0.3, 0.0, speed_m_per_s=4.0, time_sigma_s=0.1) == pytest.approx(0.5)


@pytest.mark.parametrize("k", [0.0, -1.0, math.nan, math.inf])
def test_a_tolerance_of_no_sigmas_is_refused(k: float) -> None:
    with pytest.raises(DetectionInputError, match="k must be a number > 0"):
        false_positive_rate(k)


@pytest.mark.parametrize("rate", [0.0, 1.0, -0.1, math.nan])
def test_a_rate_that_is_none_is_refused(rate: float) -> None:
    with pytest.raises(DetectionInputError, match="false-positive rate lies between 0 and 1"):
        k_for_false_positive_rate(rate)


@pytest.fixture(scope="module")
def exceedances() -> Floats:
    """Statistics of 160 000 clear ranges against the place that their epochs fit, as shares of one sigma."""
    rng = np.random.default_rng(7)
    true_m, everyone = true_ranges(DRONES_M, ROVER_M), (1 << 8) - 1
    sigmas_m = np.linspace(0.05, 0.3, 8)
    rules = Rules(False, True, True, 4, (math.nan, math.nan, 0.0))
    statistic, excess_m, work = np.empty(8), np.empty(8), (np.empty(8), np.empty(8))
    all_statistics = np.empty((20_000, 8))
    for row in all_statistics:
        # a tolerance of many sigmas, so that every set is taken as it is
        ranges = Ranges(DRONES_M, true_m + sigmas_m * rng.normal(size=8), sigmas_m, 50.0 * sigmas_m, np.zeros(8))
        _, place, *_ = subsets.place_of(ranges, everyone, rules, work)
        misfits.statistics(ranges, everyone, False, place, True, excess_m, statistic)
        row[:] = 50.0 * statistic
    return all_statistics


@PROMISED
def test_clear_ranges_exceed_k_sigma_of_the_geometry_as_often_as_k_says(
    exceedances: Floats, k: float, rate: float
) -> None:
    assert agrees(int((exceedances > k).sum()), exceedances.size, false_positive_rate(k))
    assert (exceedances > k).mean() == pytest.approx(
        rate, rel=0.15, abs=STANDARD_DEVIATIONS * math.sqrt(rate / 160_000)
    )


@PROMISED
def test_clear_ranges_exceed_k_sigma_of_odometry_as_often_as_k_says(k: float, rate: float) -> None:
    """Each range is held against the one before, with the way between known: both noises and the wheels' count."""
    rng = np.random.default_rng(8)
    anchors = drones(8)
    exact = {"heading_sigma_rad": 0.0, "heading_offset_sigma_rad": 0.0, "heading_drift_rad_per_s": 0.0}
    settings = DetectorSettings(k_odometry=k, range_sigma_m=0.1, wheel_sigma_m=0.05, **exact)
    beyond = judged = 0
    for _ in range(25):
        detector = Detector(anchors, settings)
        place_m = ROVER_M + np.array([0.0, -100.0, 0.0])
        for second in range(100):
            odometry = None
            if second:
                place_m = place_m + np.array([0.0, 2.0, 0.0])
                odometry = OdometryIncrement(1.0, (2.0 + 0.05 * rng.normal(), 0.0), heading_rad=0.0)
            ranges_m = true_ranges(DRONES_M, place_m) + 0.1 * rng.normal(size=8)
            answer = detector.process(
                heard(float(second), dict(zip((a.id for a in anchors), ranges_m.tolist(), strict=True)), odometry)
            )
            evidence = [verdict.says[1].evidence for verdict in answer.verdicts]
            beyond += sum(e > 1.0 for e in evidence)
            judged += sum(not math.isnan(e) for e in evidence)
    assert judged > 18_000
    assert beyond / judged < 1.3 * rate + STANDARD_DEVIATIONS * math.sqrt(rate / judged)
    assert beyond / judged > 0.4 * rate - STANDARD_DEVIATIONS * math.sqrt(rate / judged)
