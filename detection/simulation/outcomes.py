"""What became of a drive: the detector's word on each range beside the truth, and where it thought the rover was."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from detection.detector import Detector, detect_epoch
from detection.epochs import RangeEpoch
from detection.settings import DetectorSettings
from detection.verdicts import EpochResult, Sight

from .drives import Floats, SimulatedDrive

__all__ = ["DriveOutcome", "judge_by_epoch", "judge_drive", "locate_without_detector"]

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
