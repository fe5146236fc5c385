"""Replays of real range logs through the detector and through its geometric step alone: what came out per range."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchmarks.detection.measured_ranges import RangeLog
from benchmarks.detection.ranking import area_under_curve, caught_at
from detection import Detector, DetectorSettings, detect_3d

__all__ = ["Replay", "geometric_step", "plain_fit", "pooled", "session"]

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

# The geometric step alone cannot tell above the anchors from below them. All it is told is that the floor is below.
FLOOR_M = (math.nan, math.nan, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Replay:
    """Per range: score, flag, whether the truth has it bad, whether the truth contradicts itself there.
    Per epoch: off_m, how far the position is from the truth, NaN without one; time_s."""

    score: Floats
    flagged: Bools
    bad: Bools
    wrong_truth: Bools
    off_m: Floats
    time_s: Floats

    @property
    def area(self) -> float:
        """Area under the curve of caught against false alarms."""
        return area_under_curve(self.score, self.bad)

    @property
    def rms_m(self) -> float:
        """Root mean square of the position error, over epochs with a position."""
        return float(np.sqrt(np.nanmean(self.off_m**2)))

    def caught(self, false_alarms: float) -> float:
        """Share of the bad ranges caught at so large a share of false alarms."""
        return caught_at(self.score, self.bad, false_alarms)

    def where_truth_holds(self) -> Replay:
        """The same without the ranges whose truth contradicts itself (positions stay as they are)."""
        good = ~self.wrong_truth
        return Replay(
            self.score[good], self.flagged[good], self.bad[good], self.wrong_truth[good], self.off_m, self.time_s
        )


def pooled(replays: Sequence[Replay]) -> Replay:
    """All ranges and epochs of several logs together."""
    return Replay(*(np.concatenate([getattr(one, name) for one in replays]) for name in Replay.__slots__))


def session(log: RangeLog, settings: DetectorSettings, bad_m: float) -> Replay:
    """The whole detector, epoch by epoch: no answer knows of a later epoch."""
    detector = Detector(log.anchors, settings)
    score, flagged, off_m = [], [], []
    for epoch, place_m in zip(log.epochs, log.places_m, strict=True):
        answer = detector.process(epoch)
        verdicts = {verdict.anchor_id: verdict for verdict in answer.verdicts}
        for one in epoch.ranges:  # a range that the detector refuses (plaza has one below zero) counts as surely bad
            verdict = verdicts.get(one.anchor_id)
            score.append(math.inf if verdict is None else verdict.score)
            flagged.append(verdict is None or verdict.off)
        off_m.append(math.nan if answer.position is None else math.dist(answer.position.position_m, place_m))
    return _replay(log, score, flagged, off_m, bad_m)


def geometric_step(
    log: RangeLog, tolerance_m: float, bad_m: float, hint_m: tuple[float, float, float] | None = FLOOR_M
) -> Replay:
    """The geometric step alone, every epoch by itself; score: |excess| over the place where most ranges meet."""
    places = {anchor.id: (anchor.east_m, anchor.north_m, anchor.altitude_m) for anchor in log.anchors}
    score, flagged, off_m = [], [], []
    for epoch, place_m in zip(log.epochs, log.places_m, strict=True):
        found = detect_3d(
            [places[one.anchor_id] for one in epoch.ranges], [one.range_m for one in epoch.ranges], tolerance_m,
            hint_m=hint_m,
        )  # fmt: skip
        # a range of which nothing is known ranks like one at its tolerance
        score += np.nan_to_num(found.statistic, nan=1.0).tolist()
        flagged += found.off.tolist()
        off_m.append(math.nan if found.position_m is None else math.dist(found.position_m, place_m))
    return _replay(log, score, flagged, off_m, bad_m)


def plain_fit(log: RangeLog, bad_m: float) -> Replay:
    """Least squares of all ranges of an epoch: what one has without a detector."""
    return geometric_step(log, 1e3, bad_m)


def _replay(
    log: RangeLog, score: Iterable[float], flagged: Iterable[bool], off_m: Iterable[float], bad_m: float
) -> Replay:
    errors_m = np.concatenate(log.errors_m)
    wrong = np.repeat(log.truth_is_wrong, [len(errors) for errors in log.errors_m])
    times_s = np.array([epoch.time_s for epoch in log.epochs])
    return Replay(
        np.array(list(score)), np.array(list(flagged)), np.abs(errors_m) > bad_m, wrong, np.array(list(off_m)), times_s
    )
