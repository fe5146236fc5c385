"""Areas and shares of a ranking, held against counting pairs."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.detection.measured_ranges import RANGING, starloc, starloc_sequences
from benchmarks.detection.ranking import area_under_curve, caught_at, curve
from benchmarks.detection.replays import geometric_step, session
from detection import DetectorSettings


def test_the_area_is_the_share_of_pairs_in_the_right_order() -> None:
    rng = np.random.default_rng(1)
    bad = rng.random(60) < 0.3
    score = np.round(rng.normal(size=60) + bad, 1)  # with ties
    pairs = [
        (score[i] > score[j]) + 0.5 * (score[i] == score[j]) for i in np.flatnonzero(bad) for j in np.flatnonzero(~bad)
    ]
    assert area_under_curve(score, bad) == pytest.approx(float(np.mean(pairs)))


def test_the_curve_goes_through_the_share_caught() -> None:
    rng = np.random.default_rng(2)
    bad = rng.random(5000) < 0.2
    score = rng.normal(size=5000) + 2.0 * bad
    false_alarms, caught = curve(score, bad)
    assert (false_alarms[-1], caught[-1]) == (1.0, 1.0)
    assert np.interp(0.05, false_alarms, caught) == pytest.approx(caught_at(score, bad, 0.05), abs=0.01)


# docs/detection-proof.md; in other sequences the recorded truth is wrong for long
PROMISED_ON = "loop-2d-fast_s1"


@pytest.mark.skipif(not RANGING.exists(), reason="the ranging logs are not beside the checkout")
def test_on_real_ranges_the_detector_catches_what_it_promises_and_the_geometric_step_less() -> None:
    """Eight seconds of one tag of the sequence that the promise is of; the whole logs are the benchmark's."""
    for sequence in (one for one in starloc_sequences() if one.name == PROMISED_ON):
        log = starloc(sequence)[0]
        short = log.first(110)
        fused = session(short, DetectorSettings(harmful_m=0.5), 0.5)
        alone = geometric_step(short, 0.3, 0.5)
        holds = fused.where_truth_holds()
        assert holds.area > 0.985
        assert holds.area > alone.where_truth_holds().area
        assert fused.rms_m < 0.2 < alone.rms_m
