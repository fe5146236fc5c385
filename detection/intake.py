"""What of an epoch can be used: everything a sensor may deliver wrongly is named, set aside and counted."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Container
from dataclasses import dataclass

from .epochs import OdometryIncrement, RangeEpoch, RangeMeasurement
from .settings import DetectorSettings
from .verdicts import RejectedRange, Rejection

__all__ = ["Intake", "take_in"]

# A range that errs by more says nothing, and its variance may be beyond floating point.
LARGEST_SIGMA_M = 1e12


@dataclass(frozen=True, slots=True)
class Intake:
    """The usable part of an epoch, and what was set aside with its reason."""

    ranges: tuple[RangeMeasurement, ...]
    odometry: OdometryIncrement | None
    rejected: tuple[RejectedRange, ...]


def take_in(epoch: RangeEpoch, known: Container[str], settings: DetectorSettings) -> Intake:
    """Sort an epoch's ranges and odometry into usable and rejected. Of an anchor that comes twice, neither is used."""
    counts = Counter([measured.anchor_id for measured in epoch.ranges])
    twice = {anchor_id for anchor_id, count in counts.items() if count > 1}
    ranges, rejected = [], []
    for measured in epoch.ranges:
        reason = _range_rejection(measured, known, twice, settings)
        if reason is None:
            ranges.append(measured)
        else:
            rejected.append(RejectedRange(measured.anchor_id, reason))
    odometry = epoch.odometry
    if odometry is not None and not _usable(odometry):
        odometry = None
        rejected.append(RejectedRange("", Rejection.BAD_ODOMETRY))
    return Intake(tuple(ranges), odometry, tuple(rejected))


def _range_rejection(
    measured: RangeMeasurement, known: Container[str], twice: set[str], settings: DetectorSettings
) -> Rejection | None:
    if measured.anchor_id not in known:
        return Rejection.UNKNOWN_ANCHOR
    if measured.anchor_id in twice:
        return Rejection.ANCHOR_TWICE
    if not math.isfinite(measured.range_m):
        return Rejection.NOT_FINITE
    if measured.range_m <= 0.0:
        return Rejection.NOT_POSITIVE
    if measured.range_m > settings.max_range_m:
        return Rejection.TOO_LONG
    if measured.sigma_m is not None and not 0.0 < measured.sigma_m <= LARGEST_SIGMA_M:
        return Rejection.BAD_SIGMA
    if measured.p_sight is not None and not 0.0 <= measured.p_sight <= 1.0:
        return Rejection.BAD_PRIOR
    if measured.time_s is not None and not math.isfinite(measured.time_s):
        return Rejection.BAD_TIME
    return None


def _usable(odometry: OdometryIncrement) -> bool:
    numbers = [*(odometry.wheel_m or ()), *(odometry.accelerometer_m or ())]
    if odometry.heading_rad is not None:
        numbers.append(odometry.heading_rad)
    return 0.0 < odometry.duration_s < math.inf and all(map(math.isfinite, numbers))
