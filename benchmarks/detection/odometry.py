"""The odometry test on the mower of plaza 1: false alarms on its ranges, and injected biases caught."""

from __future__ import annotations

import math
from dataclasses import replace
from statistics import NormalDist

import numpy as np
import numpy.typing as npt

from benchmarks.detection.measured_ranges import RANGING, RangeLog, plaza
from benchmarks.report import Row, Table
from detection import Detector, DetectorSettings, EpochResult, RangeEpoch, RangeMeasurement

__all__ = ["odometry_on_plaza"]

Bools = npt.NDArray[np.bool_]

# From data sheets, not from the truth: the radio resolves about 0.5 m, and encoders of a tenth of a foot count the way
# of a mower between two ranges to some centimetres. Nothing else is told.
PLAZA = DetectorSettings(dimension=2, range_sigma_m=0.5, wheel_sigma_m=0.05, max_speed_m_per_s=3.0)
BIASES_M = (0.0, 1.0, 2.0, 5.0)
SEED = 3
EVERY_S, LASTS_S = 240.0, 30.0  # each beacon is occluded so often, for so long, one at a time
SINGLE = 20  # one range in so many is too long by itself


def odometry_on_plaza() -> Table:
    """False alarms and catches of the odometry witness alone, and of the verdict it is part of."""
    columns = (
        "k", "bias", "one range: odometry test", "as noise allows", "30 s: odometry test", "30 s: verdict",
        "onsets noticed", "median response",
    )  # fmt: skip
    if not (RANGING / "plaza").exists():
        return Table("Odometry test on plaza 1", columns, (), "The log is not there; nothing was measured.")
    log, rows = plaza(), []
    single = np.random.default_rng(SEED).permutation(len(log.epochs)) % SINGLE == 0
    lasting = _hidden(log)
    for k in (2.0, 3.0):
        settings = replace(PLAZA, k_odometry=k)
        for bias_m in BIASES_M:
            once = _found(_with_bias(log, single, bias_m), settings)
            long = _found(_with_bias(log, lasting, bias_m), settings)
            if bias_m == 0.0:
                everything = np.ones(len(single), np.bool_)
                cells = (
                    _share(once[0], everything),
                    _allowed(0.0, k),
                    _share(long[0], everything),
                    _share(long[1], everything),
                )
                rows.append(Row((f"{k:g}", "none: false alarms", *cells, "–", "–")))
                continue
            noticed, response_s = _onsets(log, lasting, long[1])
            cells = (_share(once[0], single), _allowed(bias_m, k), _share(long[0], lasting), _share(long[1], lasting))
            rows.append(Row((f"{k:g}", f"{bias_m:g} m", *cells, f"{noticed:.0%}", f"{response_s:.1f} s")))
    note = (
        "3529 ranges of 4 beacons, one an epoch, with wheel odometry; ranges calibrated per beacon, noise 0.5 m. One "
        f"range: a bias on one range in {SINGLE}. 30 s: a bias on one beacon after the other. The test's tolerance is "
        "k sigma of the noise of two ranges and of the way between; what noise allows follows from that alone."
    )
    return Table("Odometry test on plaza 1", columns, rows, note)


def _share(found: Bools, among: Bools) -> str:
    return f"{found[among].mean():.1%}"


def _allowed(bias_m: float, k: float) -> str:
    """Share of changes beyond k sigma when both ranges are noisy and one is too long by so much."""
    sigma_m = math.sqrt(2.0) * PLAZA.range_sigma_m
    normal = NormalDist(bias_m, sigma_m)
    return f"{1.0 - normal.cdf(k * sigma_m) + normal.cdf(-k * sigma_m):.1%}"


def _found(log: RangeLog, settings: DetectorSettings) -> tuple[Bools, Bools]:
    """Per epoch: beyond the tolerance of the odometry test; flagged by the verdict."""
    detector = Detector(log.anchors, settings)
    answers = [detector.process(epoch) for epoch in log.epochs]
    return (
        np.array([_evidence(answer) > 1.0 for answer in answers]),
        np.array([bool(answer.excluded) for answer in answers]),
    )


def _evidence(answer: EpochResult) -> float:
    said = [verdict.says[1].evidence for verdict in answer.verdicts]
    return said[0] if said and not math.isnan(said[0]) else 0.0


def _hidden(log: RangeLog) -> Bools:
    """Epochs whose beacon is occluded: one beacon after the other, each every so often."""
    times_s = np.array([epoch.time_s for epoch in log.epochs])
    names = np.array([epoch.ranges[0].anchor_id for epoch in log.epochs])
    beacons = np.unique(names)
    hidden = np.zeros(len(names), np.bool_)
    for number, name in enumerate(beacons):
        phase_s = EVERY_S * (number + 0.5) / len(beacons)
        hidden |= (names == name) & ((times_s - times_s[0] - phase_s) % EVERY_S < LASTS_S)
    found: Bools = hidden & (times_s - times_s[0] > LASTS_S)
    return found


def _with_bias(log: RangeLog, hidden: Bools, bias_m: float) -> RangeLog:
    epochs = []
    for epoch, too_long in zip(log.epochs, hidden, strict=True):
        one: RangeMeasurement = epoch.ranges[0]
        longer: RangeEpoch = replace(epoch, ranges=(replace(one, range_m=one.range_m + bias_m),))
        epochs.append(longer if too_long else epoch)
    return replace(log, epochs=tuple(epochs))


def _onsets(log: RangeLog, hidden: Bools, flagged: Bools) -> tuple[float, float]:
    """(share of stretches flagged at least once, median seconds from a stretch's first range to the first flag)."""
    times_s = np.array([epoch.time_s for epoch in log.epochs])
    names = np.array([epoch.ranges[0].anchor_id for epoch in log.epochs])
    responses_s, stretches = [], 0
    for name in np.unique(names):
        mine = np.flatnonzero((names == name) & hidden)
        for stretch in np.split(mine, np.flatnonzero(np.diff(times_s[mine]) > LASTS_S) + 1):
            if not len(stretch):
                continue
            stretches += 1
            first = stretch[flagged[stretch]]
            if len(first):
                responses_s.append(times_s[first[0]] - times_s[stretch[0]])
    return len(responses_s) / max(stretches, 1), float(np.median(responses_s)) if responses_s else math.nan
