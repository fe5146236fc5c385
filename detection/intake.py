"""What of an epoch can be used, and in what order: what a sensor may deliver wrongly is named, set aside, counted."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Container
from dataclasses import dataclass

from .epochs import GroundHeight, OdometryIncrement, RangeEpoch, RangeMeasurement
from .settings import DetectorSettings
from .verdicts import RejectedRange, Rejection

__all__ = ["EpochOrder", "Intake", "take_in"]

# So many old epochs in a row, in order among themselves, are no stragglers: the sender's clock was set back.
CLOCK_SET_BACK = 10


class EpochOrder:
    """Remembers the times of the last epochs; changed in place."""

    def __init__(self, window: int) -> None:
        self._window = window
        self._times_s: list[float] = []
        self._sequence: int | None = None
        self._old: list[float] = []

    @property
    def time_s(self) -> float | None:
        """Of the last epoch that was used."""
        return self._times_s[-1] if self._times_s else None

    def rejection(self, epoch: RangeEpoch) -> Rejection | None:
        """Why an epoch cannot be used as a whole after those before it, or None."""
        if not math.isfinite(epoch.time_s):
            return Rejection.BAD_TIME
        if self.time_s is None:
            return None
        same_sequence = epoch.sequence is not None and epoch.sequence == self._sequence
        if epoch.time_s == self.time_s or same_sequence:
            return Rejection.DUPLICATE
        if epoch.time_s > self.time_s:
            return None
        return Rejection.LATE if epoch.time_s < self._times_s[0] else Rejection.OUT_OF_ORDER

    def accept(self, epoch: RangeEpoch) -> None:
        """Take an epoch as the last one."""
        self._times_s = [*self._times_s[-self._window + 1 :], epoch.time_s] if self._window > 1 else [epoch.time_s]
        self._sequence, self._old = epoch.sequence, []

    def was_set_back(self, epoch: RangeEpoch) -> bool:
        """Whether this old epoch ends a run of old ones that are in order; then all before them is forgotten."""
        if self._old and epoch.time_s <= self._old[-1]:
            self._old = []
        self._old.append(epoch.time_s)
        if len(self._old) < CLOCK_SET_BACK:
            return False
        self._times_s, self._sequence, self._old = [], None, []
        return True


# A range that errs by more says nothing, and its variance may be beyond floating point.
LARGEST_SIGMA_M = 1e12


@dataclass(frozen=True, slots=True)
class Intake:
    """The usable part of an epoch, and what was set aside with its reason."""

    ranges: tuple[RangeMeasurement, ...]
    odometry: OdometryIncrement | None
    rejected: tuple[RejectedRange, ...]
    ground: GroundHeight | None = None


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
    ground = epoch.ground
    if ground is not None and not (settings.dimension == 3 and _is_told(ground)):
        ground = None
        rejected.append(RejectedRange("", Rejection.BAD_GROUND))
    return Intake(tuple(ranges), odometry, tuple(rejected), ground)


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


def _is_told(ground: GroundHeight) -> bool:
    numbers = (ground.east_m, ground.north_m, ground.altitude_m, ground.slope_east, ground.slope_north)
    return 0.0 < ground.sigma_m <= LARGEST_SIGMA_M and all(map(math.isfinite, numbers))
