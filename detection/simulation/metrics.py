"""What detectors said of many simulated drives, and the measures of seed 000, "Performance Metrics", over them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.stats

from ..detector import Detector, detect_epoch
from ..epochs import RangeEpoch
from ..errors import DetectionInputError
from ..settings import DetectorSettings
from ..verdicts import EpochResult, Sight
from .drives import Floats, SimulatedDrive

__all__ = [
    "DriveOutcome",
    "Estimate",
    "Metrics",
    "judge_by_epoch",
    "judge_drive",
    "locate_without_detector",
    "metrics_of",
    "response_times_s",
]

CODES = {Sight.CLEAR: 0, Sight.OCCLUDED: 1, Sight.TOO_SHORT: 1, Sight.UNKNOWN: 2}
STEPS = 12
SETTLED_M = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class DriveOutcome:
    """The words beside the truth of n epochs and k anchors.

    sight: (n, k) uint8: 0 clear, 1 occluded, 2 unknown, 255 no range. position_m: (n, d), NaN without position.
    sigma_m: (n,) root of the trace of its covariance, NaN without.
    """

    drive: SimulatedDrive
    sight: npt.NDArray[np.uint8]
    position_m: Floats
    sigma_m: Floats

    @property
    def position_error_m(self) -> Floats:
        """(n,), NaN without position."""
        error_m: Floats = np.linalg.norm(self.position_m - self.drive.places_m, axis=1)
        return error_m


def judge_drive(drive: SimulatedDrive, epochs: Sequence[RangeEpoch], settings: DetectorSettings) -> DriveOutcome:
    """One session over all epochs: each is judged with what went before."""
    detector = Detector(drive.anchors, settings)
    return _outcome(drive, (detector.process(epoch) for epoch in epochs))


def judge_by_epoch(drive: SimulatedDrive, epochs: Sequence[RangeEpoch], settings: DetectorSettings) -> DriveOutcome:
    """Each epoch by itself, without a past: what the geometry of one epoch can tell."""
    return _outcome(drive, (detect_epoch(drive.anchors, epoch, settings) for epoch in epochs))


def locate_without_detector(drive: SimulatedDrive, epochs: Sequence[RangeEpoch]) -> Floats:
    """(n, d) places by least squares from all ranges of each epoch as if none were occluded; NaN with too few.

    Gauss-Newton from the true place, so that what is left is the error of the ranges and none of the search.
    """
    numbers = {anchor.id: number for number, anchor in enumerate(drive.anchors)}
    found_m = np.full(drive.places_m.shape, np.nan)
    for n, epoch in enumerate(epochs):
        used = [numbers[measured.anchor_id] for measured in epoch.ranges]
        if len(used) < drive.places_m.shape[1]:
            continue
        ranges_m = np.array([measured.range_m for measured in epoch.ranges])
        found_m[n] = _least_squares(drive.anchor_places_m[used], ranges_m, drive.places_m[n])
    return found_m


def _least_squares(anchors_m: Floats, ranges_m: Floats, start_m: Floats) -> Floats:
    place_m = start_m.copy()
    for _ in range(STEPS):
        apart_m = place_m - anchors_m
        distances_m = np.maximum(np.linalg.norm(apart_m, axis=1), 1e-9)
        step_m = np.linalg.lstsq(apart_m / distances_m[:, None], ranges_m - distances_m, rcond=1e-6)[0]
        place_m += step_m
        if np.abs(step_m).max() < SETTLED_M:
            break
    return place_m


def _outcome(drive: SimulatedDrive, results: Iterable[EpochResult]) -> DriveOutcome:
    numbers = {anchor.id: number for number, anchor in enumerate(drive.anchors)}
    sight = np.full(drive.excess_m.shape, 255, np.uint8)
    position_m = np.full(drive.places_m.shape, np.nan)
    sigma_m = np.full(len(drive.times_s), np.nan)
    for n, result in enumerate(results):
        for verdict in result.verdicts:
            sight[n, numbers[verdict.anchor_id]] = CODES[verdict.sight]
        if result.position is not None:
            position_m[n] = result.position.position_m
            sigma_m[n] = np.sqrt(np.trace(result.position.covariance_m2))
    return DriveOutcome(drive, sight, position_m, sigma_m)


CONFIDENCE = 0.95
RESAMPLES = 2000

Counts = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Estimate:
    """A number from a sample with its 95 % interval; all NaN where there was nothing to count. count: of the sample."""

    value: float
    low: float
    high: float
    count: int


@dataclass(frozen=True, slots=True)
class Metrics:
    """How well a detector did on drives whose truth is known.

    true_positives: share of the harmful ranges (too long by more than harmful_m) that were called occluded.
    false_positives: share of the ranges in sight that were. unknown: share of all ranges on which it said neither.
    noticed: share of the onsets (a range becomes harmful after a clear one) that were called before the end of it.
    response_s: median time from onset to the first such call, of those noticed.
    availability: share of epochs with a position. valid: share with one within ``valid_m`` of the truth.
    position_rms_m: root mean square error of the positions there were.
    """

    true_positives: Estimate
    false_positives: Estimate
    unknown: Estimate
    noticed: Estimate
    response_s: Estimate
    availability: Estimate
    valid: Estimate
    position_rms_m: Estimate


def metrics_of(
    outcomes: Sequence[DriveOutcome], harmful_m: float, valid_m: float, generator: np.random.Generator
) -> Metrics:
    """The measures over all drives.

    Ranges of one drive share a track, so that rates are bootstrapped over drives (generator); since that says nothing
    about what never happened, an interval is never narrower than Wilson's for the pooled counts. Raises
    DetectionInputError.
    """
    if not outcomes:
        raise DetectionInputError("Metrics need at least one drive.")
    if not (harmful_m >= 0.0 and valid_m > 0.0):
        raise DetectionInputError("harmful_m must be >= 0 and valid_m > 0.")
    heard = [outcome.sight != 255 for outcome in outcomes]
    called = [outcome.sight == 1 for outcome in outcomes]
    harmful = [heard_ & (o.drive.excess_m > harmful_m) for heard_, o in zip(heard, outcomes, strict=True)]
    clear = [heard_ & (o.drive.excess_m == 0.0) for heard_, o in zip(heard, outcomes, strict=True)]
    waits_s = [response_times_s(outcome, harmful_m) for outcome in outcomes]
    placed = [np.isfinite(outcome.sigma_m) for outcome in outcomes]
    errors_m = [outcome.position_error_m[there] for outcome, there in zip(outcomes, placed, strict=True)]
    noticed_s = np.array([wait_s for drive_s in waits_s for wait_s in drive_s if wait_s is not None])
    return Metrics(
        _rate([(c & h).sum() for c, h in zip(called, harmful, strict=True)], [h.sum() for h in harmful], generator),
        _rate([(c & s).sum() for c, s in zip(called, clear, strict=True)], [s.sum() for s in clear], generator),
        _rate([(o.sight == 2).sum() for o in outcomes], [h.sum() for h in heard], generator),
        _rate([sum(w is not None for w in drive_s) for drive_s in waits_s], [len(w) for w in waits_s], generator),
        _median(noticed_s, generator),
        _rate([there.sum() for there in placed], [len(there) for there in placed], generator),
        _rate([(e <= valid_m).sum() for e in errors_m], [len(there) for there in placed], generator),
        _root_mean_square(errors_m, generator),
    )


def response_times_s(outcome: DriveOutcome, harmful_m: float) -> list[float | None]:
    """Seconds from each onset to the first call in its occlusion; None where there was none before it ended."""
    times_s = outcome.drive.times_s
    waits_s: list[float | None] = []
    for k in range(outcome.sight.shape[1]):
        rows = np.flatnonzero(outcome.sight[:, k] != 255)
        harmful = outcome.drive.excess_m[rows, k] > harmful_m
        called = outcome.sight[rows, k] == 1
        begins = np.flatnonzero(harmful[1:] & ~harmful[:-1]) + 1
        for begin in begins.tolist():
            ends = np.flatnonzero(~harmful[begin:])
            end = begin + int(ends[0]) if len(ends) else len(rows)
            calls = np.flatnonzero(called[begin:end])
            waits_s.append(float(times_s[rows[begin + calls[0]]] - times_s[rows[begin]]) if len(calls) else None)
    return waits_s


def _rate(parts: Sequence[int], wholes: Sequence[int], generator: np.random.Generator) -> Estimate:
    part, whole = np.array(parts, np.int64), np.array(wholes, np.int64)
    count = int(whole.sum())
    if count == 0:
        return Estimate(np.nan, np.nan, np.nan, 0)
    low, high = scipy.stats.binomtest(int(part.sum()), count).proportion_ci(CONFIDENCE, method="wilson")
    shares = _resampled(part.astype(np.float64), whole.astype(np.float64), generator)
    if shares is not None:
        low, high = min(low, shares[0]), max(high, shares[1])
    return Estimate(float(part.sum() / count), float(low), float(high), count)


def _median(values: Floats, generator: np.random.Generator) -> Estimate:
    if len(values) == 0:
        return Estimate(np.nan, np.nan, np.nan, 0)
    median = float(np.median(values))
    if len(values) == 1 or np.ptp(values) == 0.0:
        return Estimate(median, median, median, len(values))
    interval = scipy.stats.bootstrap(
        (values,), np.median, n_resamples=RESAMPLES, confidence_level=CONFIDENCE, method="percentile", rng=generator
    ).confidence_interval
    return Estimate(median, float(interval.low), float(interval.high), len(values))


def _root_mean_square(errors_m: Sequence[Floats], generator: np.random.Generator) -> Estimate:
    squares = np.array([float((error_m**2).sum()) for error_m in errors_m])
    counts = np.array([float(len(error_m)) for error_m in errors_m])
    if counts.sum() == 0.0:
        return Estimate(np.nan, np.nan, np.nan, 0)
    value = float(np.sqrt(squares.sum() / counts.sum()))
    means = _resampled(squares, counts, generator)
    low, high = (value, value) if means is None else np.sqrt(means).tolist()
    return Estimate(value, min(low, value), max(high, value), int(counts.sum()))


def _resampled(parts: Floats, wholes: Floats, generator: np.random.Generator) -> tuple[float, float] | None:
    """The 95 % interval of sum(parts) / sum(wholes) as drives are drawn anew; None with a single drive."""
    kept = wholes > 0.0
    if kept.sum() < 2:
        return None
    ratios = parts[kept] / wholes[kept]
    if np.ptp(ratios) == 0.0:
        return float(ratios[0]), float(ratios[0])
    interval = scipy.stats.bootstrap(
        (parts[kept], wholes[kept]),
        lambda part, whole, axis: part.sum(axis=axis) / whole.sum(axis=axis),
        n_resamples=RESAMPLES,
        confidence_level=CONFIDENCE,
        method="percentile",
        paired=True,
        vectorized=True,
        rng=generator,
    ).confidence_interval
    return float(interval.low), float(interval.high)
